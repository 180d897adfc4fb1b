// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/point_sample.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"

namespace risley::cloud::point_sample_test {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::size_t kBeams = 6;

/// Points first, first + 1, ...: the number of a point is its range, its remainder its intensity.
Points numbered(std::size_t first, std::size_t count) {
  Points points;
  CloudHeader header;
  header.resize(points, count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto number = static_cast<double>(first + i);
    points.x[i] = 1000 + number;
    points.y[i] = 2000 - number;
    points.z[i] = 7;
    points.range[i] = number;
    points.incidence[i] = i % 2 == 0 ? 0.5 : std::numeric_limits<double>::quiet_NaN();
    points.intensity[i] = static_cast<std::uint8_t>((first + i) % kBeams);
    points.covariance[kXX][i] = number * number;
    points.covariance[kYY][i] = points.covariance[kZZ][i] = 0;
  }
  return points;
}

PointFrame moved_frame() {
  PointFrame frame;
  frame.offset = {1000, 2000, 0};
  return frame;
}

TEST(PointSampler, KeepsAllOfFewPoints) {
  PointSampler sampler(moved_frame(), 10);
  sampler.add(numbered(0, 4));
  sampler.add(numbered(4, 3));
  const PointSample sample = sampler.take();
  EXPECT_EQ(sample.points, 7U);
  EXPECT_THAT(sample.x, ElementsAre(0, 1, 2, 3, 4, 5, 6));
  EXPECT_THAT(sample.y, ElementsAre(0, -1, -2, -3, -4, -5, -6));
  EXPECT_THAT(sample.total_sigma, ElementsAre(0, 1, 2, 3, 4, 5, 6));
  EXPECT_EQ(sample.z[3], 7);
}

// Every emitter and every part of the recording has its share, however the points arrive.
TEST(PointSampler, DrawsEveryPointAlike) {
  constexpr std::size_t kPoints = 200'000, kMost = 5000;
  PointSampler at_once(moved_frame(), kMost), in_pieces(moved_frame(), kMost);
  at_once.add(numbered(0, kPoints));
  for (std::size_t first = 0; first < kPoints; first += 16) in_pieces.add(numbered(first, 16));
  const PointSample sample = at_once.take();
  EXPECT_EQ(sample.range, in_pieces.take().range);
  EXPECT_EQ(sample.points, kPoints);
  ASSERT_EQ(sample.size(), kMost);
  std::array<double, kBeams> of_beam{};
  std::array<double, 8> of_part{};
  for (std::size_t i = 0; i < sample.size(); ++i) {
    of_beam[sample.intensity[i]] += 1;
    of_part[static_cast<std::size_t>(sample.range[i]) * of_part.size() / kPoints] += 1;
    EXPECT_EQ(sample.x[i], sample.range[i]);  // columns stay together
  }
  const auto n = static_cast<double>(sample.size());
  for (const double count : of_beam) EXPECT_NEAR(count, n / kBeams, 5 * std::sqrt(n / kBeams));
  for (const double count : of_part) EXPECT_NEAR(count, n / 8, 5 * std::sqrt(n / 8));
}

TEST(PointSampler, IsOfPointsWithoutCovarianceToo) {
  Points points = numbered(0, 5);
  for (auto& column : points.covariance) column.clear();
  PointSampler sampler(moved_frame(), 2);
  sampler.add(points);
  const PointSample sample = sampler.take();
  EXPECT_EQ(sample.size(), 2U);
  EXPECT_TRUE(sample.total_sigma.empty());
  EXPECT_THROW(range_classes(sample), InvalidArgument);
}

TEST(PointSampler, RefusesToKeepNothing) { EXPECT_THROW(PointSampler({}, 0), InvalidArgument); }

TEST(RangeClasses, HoldEveryPointOnce) {
  PointSampler sampler(moved_frame(), 1000);
  sampler.add(numbered(0, 600));
  const PointSample sample = sampler.take();
  const std::vector<RangeClass> classes = range_classes(sample);
  ASSERT_EQ(classes.size(), 9U);
  std::size_t points = 0;
  for (const RangeClass& one : classes) points += one.points;
  EXPECT_EQ(points, 600U);
  const RangeClass& hundreds = classes[6];  // sigmas 100 ... 199
  EXPECT_EQ(hundreds.from, 100);
  EXPECT_EQ(hundreds.to, 200);
  EXPECT_EQ(hundreds.points, 100U);
  EXPECT_EQ(hundreds.median_sigma, 149);
  EXPECT_EQ(hundreds.high_sigma, 194);
  EXPECT_THAT(hundreds.known_incidence, DoubleNear(0.5, 1e-12));
  EXPECT_FALSE(std::isfinite(classes.back().to));
  EXPECT_EQ(whole_range(sample).points, 600U);
  EXPECT_THROW(whole_range({}), InvalidArgument);
}

}  // namespace risley::cloud::point_sample_test
