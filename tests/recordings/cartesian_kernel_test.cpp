// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/cartesian_kernel.hpp"

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"

#include "recordings/formats/cartesian.hpp"

namespace risley::recordings::cartesian_kernel_test {

Observations points_by(InstructionSet set, const std::vector<Vector3<double>>& points) {
  std::vector<double> x, y, z;
  for (const Vector3<double>& point : points) {
    x.push_back(point.x);
    y.push_back(point.y);
    z.push_back(point.z);
  }
  Observations o;
  o.resize(points.size());
  CartesianArguments a;
  a.points = points.size();
  a.step = kMillimetre;
  a.x = x.data();
  a.y = y.data();
  a.z = z.data();
  a.azimuth = o.azimuth.data();
  a.zenith = o.zenith.data();
  a.range = o.range.data();
  a.azimuth_resolution = o.azimuth_resolution.data();
  a.zenith_resolution = o.zenith_resolution.data();
  a.range_resolution = o.range_resolution.data();
  a.valid = o.valid.data();
  RISLEY_KERNEL_COPIES(set_cartesian_points).at(set)(a);
  return o;
}

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

TEST(CartesianKernel, GivesWhatOnePointGivesInEveryInstructionSet) {
  std::mt19937 random(1);
  std::vector<Vector3<double>> points;
  constexpr int kEdge = 3;
  for (int i = -kEdge; i <= kEdge; ++i) {
    for (int j = -kEdge; j <= kEdge; ++j) {
      for (int k = -kEdge; k <= kEdge; ++k) {
        points.push_back({i * kMillimetre, j * kMillimetre, k * kMillimetre});
      }
    }
  }
  for (int i = 0; i < 200'003; ++i) {
    const auto one = [&] { return (static_cast<int>(random() % 200'001) - 100'000) * kMillimetre; };
    points.push_back({one(), one(), i % 3 == 0 ? 0.0 : one()});
  }
  Observations expected;
  expected.resize(points.size());
  for (std::size_t row = 0; row < points.size(); ++row) {
    set_cartesian(expected, row, points[row], kMillimetre);
  }
  const Observations first = points_by(InstructionSet::baseline, points);
  for (std::size_t row = 0; row < points.size(); ++row) {
    ASSERT_EQ(first.valid[row], expected.valid[row]) << row;
    ASSERT_DOUBLE_EQ(first.range[row], expected.range[row]) << row;
    ASSERT_EQ(first.range_resolution[row], expected.range_resolution[row]) << row;
    ASSERT_FLOAT_EQ(first.azimuth_resolution[row], expected.azimuth_resolution[row]) << row;
    ASSERT_FLOAT_EQ(first.zenith_resolution[row], expected.zenith_resolution[row]) << row;
    if (expected.valid[row] == 0) {
      ASSERT_TRUE(std::isnan(first.azimuth[row]) && std::isnan(first.zenith[row])) << row;
      continue;
    }
    ASSERT_NEAR(first.azimuth[row], expected.azimuth[row], 5e-16) << row;
    ASSERT_NEAR(first.zenith[row], expected.zenith[row], 5e-16) << row;
    ASSERT_LE(std::abs(first.azimuth[row]), kPi) << row;
  }
  for (const InstructionSet set : available_instruction_sets()) {
    const Observations found = points_by(set, points);
    EXPECT_TRUE(same_bits(found.azimuth, first.azimuth)) << to_string(set);
    EXPECT_TRUE(same_bits(found.zenith, first.zenith)) << to_string(set);
    EXPECT_TRUE(same_bits(found.range, first.range)) << to_string(set);
    EXPECT_TRUE(same_bits(found.azimuth_resolution, first.azimuth_resolution));
    EXPECT_TRUE(same_bits(found.zenith_resolution, first.zenith_resolution));
    EXPECT_EQ(found.valid, first.valid);
  }
}

}  // namespace risley::recordings::cartesian_kernel_test
