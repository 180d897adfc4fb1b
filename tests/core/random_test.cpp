// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/random.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace risley::random_test {

struct Moments {
  double mean = 0, variance = 0, skewness = 0, kurtosis = 0;
};

Moments moments(const std::vector<double>& values) {
  Moments m;
  const auto n = static_cast<double>(values.size());
  for (const double v : values) m.mean += v / n;
  double third = 0, fourth = 0;
  for (const double v : values) {
    const double d = v - m.mean;
    m.variance += d * d / n;
    third += d * d * d / n;
    fourth += d * d * d * d / n;
  }
  m.skewness = third / std::pow(m.variance, 1.5);
  m.kurtosis = fourth / (m.variance * m.variance) - 3.0;
  return m;
}

constexpr std::size_t kMany = 400000;

TEST(RandomStream, NormalValuesHaveTheMomentsOfTheNormalDistribution) {
  std::vector<double> values(kMany);
  RandomStream(1, 2).fill_normal(0, values);
  const Moments m = moments(values);
  const double root = std::sqrt(static_cast<double>(kMany));
  EXPECT_NEAR(m.mean, 0.0, 4.0 / root);  // four standard deviations of each statistic
  EXPECT_NEAR(m.variance, 1.0, 4.0 * std::sqrt(2.0) / root);
  EXPECT_NEAR(m.skewness, 0.0, 4.0 * std::sqrt(6.0) / root);
  EXPECT_NEAR(m.kurtosis, 0.0, 4.0 * std::sqrt(24.0) / root);
}

TEST(RandomStream, UniformValuesFillTheOpenUnitInterval) {
  const RandomStream stream(3, 0);
  std::vector<double> values(kMany);
  for (std::size_t i = 0; i < kMany; ++i) values[i] = stream.uniform(i);
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  EXPECT_GT(*low, 0.0);
  EXPECT_LT(*high, 1.0);
  const Moments m = moments(values);
  const double root = std::sqrt(static_cast<double>(kMany));
  EXPECT_NEAR(m.mean, 0.5, 4.0 * std::sqrt(1.0 / 12.0) / root);
  EXPECT_NEAR(m.variance, 1.0 / 12.0, 4.0 * std::sqrt(1.0 / 180.0) / root);
}

TEST(RandomStream, NeighboursAndStreamsAreUncorrelated) {
  std::vector<double> a(kMany), b(kMany), c(kMany);
  RandomStream(1, 2).fill_normal(0, a);
  RandomStream(1, 3).fill_normal(0, b);
  RandomStream(2, 2).fill_normal(0, c);
  double lag1 = 0, lag2 = 0, streams = 0, seeds = 0;
  for (std::size_t i = 0; i + 2 < kMany; ++i) {
    lag1 += a[i] * a[i + 1];
    lag2 += a[i] * a[i + 2];
    streams += a[i] * b[i];
    seeds += a[i] * c[i];
  }
  const double allowed = 4.0 * std::sqrt(static_cast<double>(kMany));
  for (const double sum : {lag1, lag2, streams, seeds}) EXPECT_LT(std::abs(sum), allowed);
}

TEST(RandomStream, BlocksOfAnySizeGiveTheSameValues) {
  const RandomStream stream(7, 11);
  std::vector<double> whole(1000);
  stream.fill_normal(0, whole);
  for (const std::size_t size : {1u, 3u, 4u, 7u, 64u, 333u}) {
    std::vector<double> pieces(whole.size());
    for (std::size_t first = 0; first < pieces.size(); first += size) {
      const std::size_t count = std::min(size, pieces.size() - first);
      stream.fill_normal(first, std::span(pieces).subspan(first, count));
    }
    EXPECT_EQ(pieces, whole) << "blocks of " << size;
  }
  for (const std::size_t i : {0u, 1u, 2u, 3u, 4u, 999u}) EXPECT_EQ(stream.normal(i), whole[i]);
}

TEST(RandomStream, ValuesAreAllDifferent) {
  const RandomStream stream(0, 0);
  std::set<double> seen;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    seen.insert(stream.normal(i));
    seen.insert(stream.uniform(i));
  }
  EXPECT_EQ(seen.size(), 2000u);
}

TEST(RandomStream, SeedsMeanTheSameInEveryRelease) {
  const RandomStream stream(42, 1);
  EXPECT_DOUBLE_EQ(stream.uniform(0), 0.37294333442216854);
  EXPECT_DOUBLE_EQ(stream.uniform(1000000007), 0.17556159044927033);
  EXPECT_DOUBLE_EQ(stream.normal(0), -0.30779914934110242);
  EXPECT_DOUBLE_EQ(stream.normal(1), -0.97750848127603052);
  EXPECT_DOUBLE_EQ(stream.normal(1000000007), -1.4653963713153733);
}

}  // namespace risley::random_test
