// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/smooth_ground.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"

namespace risley::calibration::smooth_ground_test {

constexpr double kNoise = 0.005;  // of a tilt, rad

/// Cells of 2 m of a ground z(x, y) whose normals have noise.
template <class Slope>
std::vector<GroundPlane> ground(const Slope& slope) {
  std::mt19937_64 generator(4);
  std::normal_distribution<double> noise(0, kNoise);
  std::vector<GroundPlane> planes;
  for (double x = -40; x < 40; x += 2) {
    for (double y = -40; y < 40; y += 2) {
      const Eigen::Vector2d s = slope(x, y);
      GroundPlane plane;
      plane.centre = {x, y, 0};
      plane.normal =
          Eigen::Vector3d(-s.x() + noise(generator), -s.y() + noise(generator), 1).normalized();
      planes.push_back(plane);
    }
  }
  return planes;
}

std::vector<Eigen::Matrix2d> information(std::size_t planes) {
  return std::vector<Eigen::Matrix2d>(planes, Eigen::Matrix2d::Identity() / (kNoise * kNoise));
}

/// RMS of slopes about the true ones.
template <class Slope>
double off(const std::vector<GroundPlane>& planes, const Slope& slope) {
  double squares = 0;
  for (const GroundPlane& plane : planes) {
    const Eigen::Vector2d own = -plane.normal.head<2>() / plane.normal.z();
    squares += (own - slope(plane.centre.x(), plane.centre.y())).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(planes.size()));
}

TEST(SmoothGround, FieldsAreOnePlane) {
  for (const double slope : {0.0, 0.3}) {
    const auto field = [&](double, double) { return Eigen::Vector2d(slope, -slope); };
    const std::vector<GroundPlane> planes = ground(field);
    EXPECT_LT(off(smooth_ground(planes, information(planes.size())), field), 0.1 * kNoise);
  }
}

TEST(SmoothGround, HillsKeepTheirSlopes) {
  const auto hills = [](double x, double y) {
    return Eigen::Vector2d(0.05 * std::sin(x / 60), 0.04 * std::cos(y / 60));
  };
  const std::vector<GroundPlane> planes = ground(hills);
  EXPECT_LT(off(smooth_ground(planes, information(planes.size())), hills), 1.5 * kNoise);
}

TEST(SmoothGround, RoofsAreAsTheyWere) {
  const auto village = [](double x, double y) {
    const bool roof = std::abs(std::fmod(std::abs(x), 14)) < 4 && std::abs(y) < 20;
    return Eigen::Vector2d(roof ? 0.5 : 0, 0);
  };
  const std::vector<GroundPlane> planes = ground(village);
  const std::vector<GroundPlane> smooth = smooth_ground(planes, information(planes.size()));
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const Eigen::Vector3d& centre = planes[i].centre;
    if (village(centre.x(), centre.y()).x() > 0) {
      EXPECT_EQ(smooth[i].normal, planes[i].normal);
    } else {
      EXPECT_LT(std::hypot(smooth[i].normal.x(), smooth[i].normal.y()), 0.5 * kNoise) << i;
    }
    EXPECT_EQ(smooth[i].centre, planes[i].centre);
  }
}

TEST(SmoothGround, NormalsMayPointDownwards) {
  const auto field = [](double, double) { return Eigen::Vector2d(0.1, 0); };
  std::vector<GroundPlane> planes = ground(field);
  for (GroundPlane& plane : planes) plane.normal = -plane.normal;
  for (const GroundPlane& plane : smooth_ground(planes, information(planes.size()))) {
    EXPECT_LT(plane.normal.z(), 0);
  }
}

TEST(SmoothGround, FewCellsStayAsTheyAre) {
  const auto field = [](double, double) { return Eigen::Vector2d(0, 0); };
  std::vector<GroundPlane> planes = ground(field);
  planes.resize(10);
  const std::vector<GroundPlane> smooth = smooth_ground(planes, information(10));
  for (std::size_t i = 0; i < planes.size(); ++i) EXPECT_EQ(smooth[i].normal, planes[i].normal);
  EXPECT_THROW(smooth_ground(planes, information(9)), InvalidArgument);
}

}  // namespace risley::calibration::smooth_ground_test
