// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/smooth_ground.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include <Eigen/Core>

#include "risley/calibration/planar_adjustment.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"

#include "calibration/eigen_vectors.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::Vector2d;

/// A lean is significant from this chi2 of its two tilts on: chance reaches it once in 20,000
/// cells.
constexpr double kLeaningChi2 = 20;
/// Surroundings are squares of this size, with at least this many cells.
constexpr double kSurroundings = 20;  // m
constexpr std::size_t kFewestNeighbours = 20;
constexpr int kMeanRounds = 2;

/// Of the height over east and north.
Vector2d slope_of(const GroundPlane& plane) { return -plane.normal.head<2>() / plane.normal.z(); }

bool is_wall(const GroundPlane& plane) { return plane.normal.z() == 0; }

/// From a plane's normal to that of a slope, along its tangents, rad.
Vector2d lean_to(const Vector2d& slope, const GroundPlane& plane) {
  const Eigen::Vector3d wanted(-slope.x(), -slope.y(), 1);
  const auto [first, second] = tangents_of(plain(plane.normal));
  return Vector2d(wanted.dot(eigen(first)), wanted.dot(eigen(second))) / wanted.dot(plane.normal);
}

void give_slope(const Vector2d& slope, GroundPlane& plane) {
  const double side = plane.normal.z() > 0 ? 1 : -1;
  plane.normal = side * Eigen::Vector3d(-slope.x(), -slope.y(), 1).normalized();
}

bool is_like(const Vector2d& slope, const GroundPlane& plane, const Matrix2d& information) {
  const Vector2d lean = lean_to(slope, plane);
  return lean.dot(information * lean) < kLeaningChi2;
}

/// Slope of most of some planes: the mean of those that differ from the median only by noise.
Vector2d common_slope(const std::vector<GroundPlane>& planes,
                      const std::vector<Matrix2d>& information,
                      const std::vector<std::size_t>& members) {
  std::vector<double> east, north;
  for (const std::size_t i : members) {
    const Vector2d slope = slope_of(planes[i]);
    east.push_back(slope.x());
    north.push_back(slope.y());
  }
  Vector2d common{median(east), median(north)};
  for (int round = 0; round < kMeanRounds; ++round) {
    Vector2d sum = Vector2d::Zero();
    double count = 0;
    for (const std::size_t i : members) {
      if (!is_like(common, planes[i], information[i])) continue;
      sum += slope_of(planes[i]);
      ++count;
    }
    if (count == 0) break;
    common = sum / count;
  }
  return common;
}

}  // namespace

std::vector<Matrix2d> tilt_information(std::size_t planes, const FlightEquations& equations) {
  using Rows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;
  const Index stride = equations.globals + 2 * kCorrections + 1 + 3;
  std::vector<Eigen::Matrix3d> sums(planes, Eigen::Matrix3d::Zero());
  for (const PlaneBlock& block : equations.plane_blocks) {
    const Eigen::Map<const Rows> rows(equations.plane_products.data() + block.at, 3, stride);
    sums[block.plane] += rows.rightCols<3>();
  }
  std::vector<Matrix2d> information;
  information.reserve(planes);
  for (const Eigen::Matrix3d& sum : sums) {
    const Vector2d with_offset = sum.topRightCorner<2, 1>();
    Matrix2d own = sum.topLeftCorner<2, 2>();
    if (sum(2, 2) > 0) own -= with_offset * with_offset.transpose() / sum(2, 2);
    information.push_back(own);
  }
  return information;
}

std::vector<GroundPlane> smooth_ground(const std::vector<GroundPlane>& planes,
                                       const std::vector<Matrix2d>& information) {
  require_length("information", information.size(), planes.size());
  std::vector<GroundPlane> smooth = planes;
  std::vector<std::size_t> all;
  std::map<std::pair<std::int64_t, std::int64_t>, std::vector<std::size_t>> squares;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (is_wall(planes[i])) continue;
    all.push_back(i);
    const auto square_of = [](double at) {
      return static_cast<std::int64_t>(std::floor(at / kSurroundings));
    };
    squares[{square_of(planes[i].centre.x()), square_of(planes[i].centre.y())}].push_back(i);
  }
  if (all.size() < kFewestNeighbours) return smooth;
  // Fields are one plane; elsewhere the ground rolls.
  const Vector2d everywhere = common_slope(planes, information, all);
  for (const auto& [square, members] : squares) {
    Vector2d slope = everywhere;
    if (members.size() >= kFewestNeighbours) {
      const Vector2d here = common_slope(planes, information, members);
      GroundPlane middle = planes[members.front()];
      give_slope(here, middle);
      Matrix2d of_all = Matrix2d::Zero();
      for (const std::size_t i : members) {
        if (is_like(here, planes[i], information[i])) of_all += information[i];
      }
      if (!is_like(everywhere, middle, of_all)) slope = here;
    }
    for (const std::size_t i : members) {
      if (is_like(slope, planes[i], information[i])) give_slope(slope, smooth[i]);
    }
  }
  return smooth;
}

}  // namespace risley::calibration
