// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/surface_change.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/cloud/cloud_writer.hpp"
#include "risley/core/random.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"
#include "seeds.hpp"

namespace risley::cloud::surface_change_test {

using Eigen::Vector3d;

/// Points on ground that leans, with errors of their own, of a calibration and of a station.
struct Ground {
  double noise = 0.02;             ///< along the normal, m
  double calibration = 0.01;       ///< sigma of an error that grows with x, m at 10 m
  double station = 0.005;          ///< of a shift upwards of each station, m
  std::array<double, 3> errors{};  ///< in sigmas: calibration, two stations
  std::function<double(double, double)> rise = [](double, double) { return 0.0; };
  bool loadings = true;
  std::string calibration_hash = "abc";
  std::string text = "of a test";

  /// @param stream  of the noise
  void write(const std::string& path, std::uint64_t stream) const {
    const RandomStream random(stream, 1);
    CloudHeader header;
    header.has_rotation_angles = false;
    header.has_own_covariance = header.has_point_source = true;
    header.frame.name = text;
    header.frame.offset = {1000, 2000, 0};
    if (loadings) header.factors = {"wedge_angle_deg", "station_shift_z_m"};
    header.factors_of_source = loadings ? 1 : 0;
    header.provenance = {{"calibration_sha256", calibration_hash}};
    Points points;
    constexpr std::size_t kPoints = 20'000;  // of 10 x 5 m, 100 in a cell of 0.5 m
    header.resize(points, kPoints);
    for (std::size_t i = 0; i < kPoints; ++i) {
      const double x = 10 * random.uniform(3 * i), y = 5 * random.uniform(3 * i + 1);
      const std::uint16_t source = i % 2 == 0 ? 1 : 2;
      const Vector3d bend(0, 0, calibration * x / 10), up(0, 0, station);
      const Vector3d n = Vector3d(-0.2, 0, 1).normalized();
      Vector3d at(1000 + x, 2000 + y, 0.2 * x + rise(x, y));
      at += noise * random.normal(kPoints * 3 + i) * n + errors[0] * bend + errors[source] * up;
      points.x[i] = at.x();
      points.y[i] = at.y();
      points.z[i] = at.z();
      points.point_source[i] = source;
      points.return_number[i] = points.number_of_returns[i] = 1;
      const Eigen::Matrix3d own = noise * noise * n * n.transpose();
      const Eigen::Matrix3d all = own + bend * bend.transpose() + up * up.transpose();
      const CovarianceTerm terms[] = {kXX, kXY, kXZ, kYY, kYZ, kZZ};
      const int of[][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
      for (std::size_t k = 0; k < 6; ++k) {
        points.own_covariance[terms[k]][i] = own(of[k][0], of[k][1]);
        points.covariance[terms[k]][i] = all(of[k][0], of[k][1]);
      }
      if (!loadings) continue;
      points.loading[0][2][i] = bend.z();
      points.loading[1][2][i] = up.z();
    }
    const auto writer = create_cloud(path, header);
    writer->write(points);
    writer->close();
  }
};

struct Sums {
  double ratio = 0, significant = 0, sigma = 0, cells = 0;
};

class SurfaceChangeTest : public ::testing::Test {
 protected:
  SurfaceChange compare(const Ground& a, const Ground& b, std::uint64_t seed,
                        const ChangeOptions& options = {}) const {
    a.write(folder_.file("a.las"), 2 * seed);
    b.write(folder_.file("b.las"), 2 * seed + 1);
    return surface_change(CloudFile(folder_.file("a.las")), CloudFile(folder_.file("b.las")),
                          options);
  }
  /// Squares of distances over variances and share of false alarms over surveys without change.
  Sums surveys(Ground a, Ground b, bool one_calibration, std::uint64_t seeds) const {
    Sums sums;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      const RandomStream errors(seed, 7);
      a.errors = {errors.normal(0), errors.normal(1), errors.normal(2)};
      b.errors = {one_calibration ? a.errors[0] : errors.normal(3), errors.normal(4),
                  errors.normal(5)};
      for (const SurfaceCell& cell : compare(a, b, seed).cells) {
        sums.ratio += cell.distance * cell.distance / (cell.sigma * cell.sigma);
        sums.significant += cell.significant ? 1 : 0;
        sums.sigma += cell.sigma;
        sums.cells += 1;
      }
    }
    return {sums.ratio / sums.cells, sums.significant / sums.cells, sums.sigma / sums.cells,
            sums.cells};
  }

  io::TestFolder folder_;
};

// Surveys share nothing, cells of one survey nearly all: a survey counts as two independent cells.
TEST_F(SurfaceChangeTest, DistancesScatterAsStatedAndFalseAlarmsAreAsRareAsStated) {
  const auto seeds = static_cast<std::uint64_t>(testing::seeds_or(30));
  const Sums one = surveys({}, {}, true, seeds);
  EXPECT_GT(one.cells, 150 * static_cast<double>(seeds));
  const double band = 4 * std::sqrt(2 / (2 * static_cast<double>(seeds)));
  EXPECT_NEAR(one.ratio, 1, band);
  EXPECT_LT(one.significant, 0.01 + 4 * std::sqrt(0.01 / (2 * static_cast<double>(seeds))));
  Ground other;
  other.calibration_hash = "def";
  const Sums two = surveys({}, other, false, seeds);
  EXPECT_NEAR(two.ratio, 1, band);
  // One calibration cancels, two add up.
  EXPECT_GT(two.sigma, 1.3 * one.sigma);
}

TEST_F(SurfaceChangeTest, FactorsOfTheCalibrationCancelWhereItIsTheSame) {
  Ground same;
  same.station = 0;
  const SurfaceChange change = compare(same, same, 1);
  EXPECT_EQ(change.shared, 1U);
  for (const SurfaceCell& cell : change.cells) {
    // Noise alone: of 100 points each, or fewer at the edges.
    const double noise = 0.02 * std::sqrt(1.0 / static_cast<double>(cell.points_a) +
                                          1.0 / static_cast<double>(cell.points_b));
    EXPECT_NEAR(cell.sigma, noise, 0.35 * noise);
  }
}

TEST_F(SurfaceChangeTest, ABumpIsFoundWhereItIs) {
  Ground before, after;
  before.noise = after.noise = 0.01;
  before.station = after.station = 0.001;
  after.rise = [](double x, double y) { return x > 4 && x < 6 && y > 1 && y < 4 ? 0.01 : 0; };
  const SurfaceChange change = compare(before, after, 3);
  std::size_t found = 0, bump = 0, elsewhere = 0;
  for (const SurfaceCell& cell : change.cells) {
    const double x = cell.place.x() - 1000, y = cell.place.y() - 2000;
    if (x > 4.4 && x < 5.6 && y > 1.4 && y < 3.6) {
      ++bump;
      found += cell.significant ? 1 : 0;
      EXPECT_NEAR(cell.distance, 0.01 * cell.normal.z(), 5 * cell.sigma);
    } else if (x < 3.6 || x > 6.4) {
      elsewhere += cell.significant ? 1 : 0;
    }
  }
  EXPECT_GE(bump, 6U);
  EXPECT_GE(found, bump - 1);
  EXPECT_LE(elsewhere, 8U);
}

// Half of the ground is rough, by 12 cm in cells of half a metre.
TEST_F(SurfaceChangeTest, WhatIsThickIsNoSurface) {
  Ground ground;
  ground.rise = [](double x, double) { return x > 5 ? 0.17 * std::sin(50 * x) : 0.0; };
  const SurfaceChange change = compare(ground, ground, 1);
  EXPECT_GT(change.uneven, 60U);
  EXPECT_GT(change.cells.size(), 60U);
  for (const SurfaceCell& cell : change.cells) EXPECT_LT(cell.place.x(), 1005.75);
}

TEST_F(SurfaceChangeTest, ACloudThatDoesNotSayWhatIsCommonAlarmsLess) {
  Ground silent;
  silent.loadings = false;
  const SurfaceChange change = compare(silent, silent, 1);
  EXPECT_EQ(change.warnings.size(), 2U);
  for (const SurfaceCell& cell : change.cells) {
    if (cell.place.x() < 1008) continue;
    EXPECT_GT(cell.sigma, 0.009);  // sqrt(2) times 8 mm, leaning
  }
}

TEST_F(SurfaceChangeTest, OtherFramesAndFilesAreRefused) {
  Ground other;
  other.text = "another";
  EXPECT_THAT(refusal([&] { compare({}, other, 1); }), NamesField("frames"));
  ChangeOptions options;
  options.cell = 0;
  EXPECT_THAT(refusal([&] { compare({}, {}, 1, options); }), NamesField("cell_size"));
  CloudHeader bare;
  bare.has_covariance = false;
  bare.has_rotation_angles = false;
  const std::string path = folder_.file("bare.las");
  const auto writer = create_cloud(path, bare);
  Points none;
  bare.resize(none, 0);
  writer->write(none);
  writer->close();
  EXPECT_TRUE(is_las_file(path));
  EXPECT_THAT(refusal<FileError>([&] { CloudFile file(path); }), NamesField("covariance"));
}

}  // namespace risley::cloud::surface_change_test
