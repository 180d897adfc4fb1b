// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/median.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace risley::median_test {

TEST(Median, IsTheMiddleOrTheMeanOfTwo) {
  std::vector<double> odd{9, -1, 4}, even{9, -1, 4, 5}, one{7}, none;
  EXPECT_EQ(median(odd), 4);
  EXPECT_EQ(median(even), 4.5);
  EXPECT_EQ(median(one), 7);
  EXPECT_TRUE(std::isnan(median(none)));
}

TEST(Median, OrQuantilesAreValuesThemselves) {
  std::vector<double> values{9, -1, 4, 5};
  EXPECT_EQ(upper_median(values), 5);
  EXPECT_EQ(quantile(values, 0.5), 4);
  EXPECT_EQ(quantile(values, 1), 9);
  EXPECT_EQ(nth_value(values, 0), -1);
}

}  // namespace risley::median_test
