// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "cloud/piece_overlap.hpp"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace risley::cloud::piece_overlap_test {

TEST(PieceOverlap, IsATenthOfASecondOfTheClock) {
  std::vector<std::int64_t> times;
  for (std::int64_t i = 0; i < 50'000; ++i) times.push_back(i * 10'000);
  EXPECT_EQ(overlap_begin(times, times.size()), 40'000U);
  EXPECT_EQ(overlap_begin(times, 5000), 0U);
  times[45'000] -= 5'000'000'000;  // a reset ends it
  EXPECT_EQ(overlap_begin(times, times.size()), 45'001U);
}

TEST(PieceOverlap, DoesNotGrowWhileTheClockStandsStill) {
  const std::vector<std::int64_t> times(1'000'000, 77);
  EXPECT_EQ(overlap_begin(times, times.size()), times.size() - kMostOverlapRows);
  EXPECT_EQ(overlap_begin(times, 100), 0U);
}

TEST(PieceOverlap, TakesTimesOfAnySize) {
  using Limits = std::numeric_limits<std::int64_t>;
  const std::vector<std::int64_t> times{Limits::min(), Limits::min() + 1, Limits::max() - 1,
                                        Limits::max()};
  EXPECT_EQ(overlap_begin(times, 4), 2U);
  EXPECT_EQ(overlap_begin(times, 2), 1U);
}

}  // namespace risley::cloud::piece_overlap_test
