// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/ground_cells.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "refusal.hpp"

namespace risley::calibration::ground_cells_test {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Points of two strips over 20 x 20 m, the second one shifted.
struct TwoStrips {
  ShotPoints points;
  std::vector<std::uint16_t> strip;

  template <class Height>
  TwoStrips(const Height& height, const Eigen::Vector3d& shift, double noise = 0.01,
            int count = 20000) {
    std::mt19937 generator(5);
    std::uniform_real_distribution<double> uniform(-10, 10);
    std::normal_distribution<double> normal(0, 1);
    for (int i = 0; i < count; ++i) {
      const bool second = i >= count / 2;
      const double x = uniform(generator), y = uniform(generator);
      const Eigen::Vector3d moved = second ? shift : Eigen::Vector3d(0, 0, 0);
      points.push_back({static_cast<float>(x + moved.x()), static_cast<float>(y + moved.y()),
                        static_cast<float>(height(x, y) + moved.z() + noise * normal(generator))});
      strip.push_back(second ? 3 : 1);
    }
  }
};

TEST(GroundCells, HaveAPlaneEach) {
  const TwoStrips strips([](double x, double y) { return 0.3 * x - 0.2 * y + 50; }, {0, 0, 0});
  const GroundCells cells = ground_cells(strips.points, strips.strip, {});
  EXPECT_EQ(cells.planes.size(), 100U);
  const Eigen::Vector3d normal = Eigen::Vector3d(-0.3, 0.2, 1).normalized();
  for (const GroundPlane& plane : cells.planes) {
    EXPECT_LT((plane.normal - normal).norm(), 0.01);
    EXPECT_NEAR(normal.dot(plane.centre - Eigen::Vector3d(0, 0, 50)), 0, 0.005);
  }
  EXPECT_NEAR(cells.scatter, 0.01 * normal.z(), 0.001);
  for (std::size_t i = 0; i < strips.points.size(); ++i) {
    ASSERT_NE(cells.plane[i], kNoPlane);
    const auto& plane = cells.planes[cells.plane[i]];
    EXPECT_LT(std::abs(plane.centre.x() - strips.points[i][0]), 2);
  }
}

TEST(GroundCells, TakeNoNoticeOfBushes) {
  std::mt19937 generator(9);
  std::uniform_real_distribution<double> uniform(0, 1);
  const TwoStrips strips(
      [&](double, double) { return uniform(generator) < 0.2 ? 2.5 * uniform(generator) : 0; },
      {0, 0, 0});
  const GroundCells cells = ground_cells(strips.points, strips.strip, {});
  for (const GroundPlane& plane : cells.planes) {
    EXPECT_NEAR(plane.centre.z(), 0, 0.01);
    EXPECT_LT((plane.normal - Eigen::Vector3d::UnitZ()).norm(), 0.02);
  }
}

TEST(GroundCells, LeaveOutWhatIsRoughSteepOrOfOneStrip) {
  GroundCellOptions options;
  options.most_roughness = 0.06;
  const TwoStrips rough([](double, double) { return 0; }, {0, 0, 0}, 0.1);
  EXPECT_EQ(ground_cells(rough.points, rough.strip, options).planes.size(), 0U);
  EXPECT_EQ(ground_cells(rough.points, rough.strip, options).rough, 100U);
  // A ridge through the middle: its cells scatter more than others, by less than that.
  const TwoStrips ridge([](double x, double) { return -0.1 * std::abs(x); }, {0, 0, 0});
  options.shift_east = 0.5;
  EXPECT_EQ(ground_cells(ridge.points, ridge.strip, options).rough, 0U);
  options.noise = 0.01;
  const GroundCells sides = ground_cells(ridge.points, ridge.strip, options);
  EXPECT_GE(sides.rough, 10U);
  EXPECT_LE(sides.rough, 13U);
  options.noise = 0;
  const TwoStrips steep([](double x, double) { return 2 * x; }, {0, 0, 0});
  options.shift_east = 0;
  EXPECT_EQ(ground_cells(steep.points, steep.strip, options).planes.size(), 0U);
  const TwoStrips apart([](double, double) { return 0; }, {100, 0, 0});
  EXPECT_EQ(ground_cells(apart.points, apart.strip, options).planes.size(), 0U);
  TwoStrips lost([](double, double) { return 0; }, {0, 0, 0});
  for (auto& point : lost.points) point[0] = kNaN;
  EXPECT_EQ(ground_cells(lost.points, lost.strip, options).planes.size(), 0U);
}

TEST(GroundCells, CirclesTakePointsOutOfTheirCells) {
  // A table of 3 m x 3 m stands on level ground; only one strip sees the south.
  TwoStrips strips([](double x, double y) { return std::hypot(x - 4, y - 4) < 3 ? 1.0 : 0.0; },
                   {0, 0, 0});
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(-10, 10);
  for (int i = 0; i < 4000; ++i) {
    strips.points.push_back(
        {static_cast<float>(uniform(generator)), static_cast<float>(uniform(generator) - 20), 0.F});
    strips.strip.push_back(3);
  }
  GroundCells cells = ground_cells(strips.points, strips.strip, {});
  const std::size_t before = cells.planes.size();
  GroundCellOptions options;
  options.noise = 0.01;
  const std::vector<std::int32_t> found = add_circles(
      strips.points,
      {{{4, 4, 77}, 1.5}, {{4, 4, 0}, 2}, {{0, -20, 0}, 1}, {{7, 4, 0}, 1}, {{50, 0, 0}, 1}},
      options, cells);
  ASSERT_EQ(found.size(), 5U);
  EXPECT_EQ(found[0], static_cast<std::int32_t>(before));
  EXPECT_EQ(found[3], kNoPlane) << "the edge of the table";
  EXPECT_EQ(found[4], kNoPlane) << "nothing there";
  ASSERT_NE(found[1], kNoPlane);
  ASSERT_NE(found[2], kNoPlane) << "one strip is enough";
  EXPECT_EQ(cells.planes.size(), before + 3);
  EXPECT_NEAR(cells.planes[before].centre.z(), 1, 0.003);
  EXPECT_NEAR(cells.planes[found[2]].centre.z(), 0, 0.003);
  for (std::size_t i = 0; i < strips.points.size(); ++i) {
    const double from = std::hypot(strips.points[i][0] - 4, strips.points[i][1] - 4);
    EXPECT_EQ(cells.plane[i] == found[0], from <= 1.5) << from;
    if (from > 1.501 && from < 1.999) {
      EXPECT_EQ(cells.plane[i], found[1]);
    }
  }
  EXPECT_NE(refusal([&] { add_circles(strips.points, {{{0, 0, 0}, 0}}, {}, cells); }), "");
}

TEST(GroundCells, DoNotDependOnThreads) {
  const TwoStrips strips([](double x, double y) { return 0.01 * x * y; }, {0, 0, 0.05});
  const auto run = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return ground_cells(strips.points, strips.strip, {});
  };
  const GroundCells one = run(1), four = run(4);
  EXPECT_EQ(one.plane, four.plane);
  EXPECT_EQ(one.scatter, four.scatter);
  for (std::size_t i = 0; i < one.planes.size(); ++i) {
    EXPECT_EQ(one.planes[i].centre, four.planes[i].centre);
    EXPECT_EQ(one.planes[i].normal, four.planes[i].normal);
  }
}

TEST(GroundCells, TellTheShiftBetweenStrips) {
  const Eigen::Vector3d shift(0.04, -0.03, 0.02);
  // Slopes to all sides.
  const TwoStrips strips([](double x, double y) { return 2 * std::sin(x / 3) * std::cos(y / 4); },
                         shift, 0.01, 200000);
  const GroundCells cells = ground_cells(strips.points, strips.strip, {});
  const auto pairs = strip_pairs(strips.points, strips.strip, cells.plane, cells.planes, 1);
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].first, 1);
  EXPECT_EQ(pairs[0].second, 3);
  EXPECT_GT(pairs[0].cells, 90U);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(pairs[0].shift[k], shift[k], std::max(4 * pairs[0].sigma[k], 0.003));
    EXPECT_LT(pairs[0].sigma[k], 0.005);
  }
  // Flat ground determines only heights.
  const TwoStrips flat([](double, double) { return 0; }, shift, 0.001, 200000);
  const GroundCells level = ground_cells(flat.points, flat.strip, {});
  const auto heights = strip_pairs(flat.points, flat.strip, level.plane, level.planes, 1);
  EXPECT_NEAR(heights[0].mean, 0.02, 0.001);
  EXPECT_NEAR(heights[0].rms, 0.02, 0.001);
  EXPECT_EQ(heights[0].sigma[0], 1);
  EXPECT_EQ(heights[0].shift[0], 0);
  EXPECT_LT(heights[0].sigma[2], 0.001);
}

TEST(GroundCells, RefuseNonsense) {
  const TwoStrips strips([](double, double) { return 0; }, {0, 0, 0}, 0.01, 100);
  const auto refused = [&](const auto& damage) {
    GroundCellOptions options;
    damage(options);
    return refusal([&] { ground_cells(strips.points, strips.strip, options); });
  };
  EXPECT_EQ(refused([](GroundCellOptions&) {}), "");
  EXPECT_NE(refused([](GroundCellOptions& o) { o.size = 0; }), "");
  EXPECT_NE(refused([](GroundCellOptions& o) { o.size = std::nan(""); }), "");
  EXPECT_NE(refused([](GroundCellOptions& o) { o.shift_east = 3; }), "");
  EXPECT_NE(refused([](GroundCellOptions& o) { o.least_shots = 2; }), "");
  EXPECT_NE(refused([](GroundCellOptions& o) { o.steepest = 2; }), "");
  EXPECT_NE(refused([](GroundCellOptions& o) { o.most_roughness = 0; }), "");
  EXPECT_NE(refused([](GroundCellOptions& o) { o.noise = -1; }), "");
  EXPECT_NE(refusal([&] { ground_cells(strips.points, {}, {}); }), "");
  EXPECT_NE(refusal([&] { strip_pairs(strips.points, strips.strip, {}, {}, 1); }), "");
}

}  // namespace risley::calibration::ground_cells_test
