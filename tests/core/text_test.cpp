// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/text.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace risley::text_test {

TEST(NearMiss, FindsWhatWasMeant) {
  const std::vector<std::string> names{"avia", "horizon", "mid-40", "mid-40-reversed", "mid-70"};
  EXPECT_EQ(near_miss("mid40", names), "mid-40");
  EXPECT_EQ(near_miss("Mid 40", names), "mid-40");
  EXPECT_EQ(near_miss("MID-07", names), "mid-70");  // swapped
  EXPECT_EQ(near_miss("horizn", names), "horizon");
  EXPECT_EQ(near_miss("mid_40_reverse", names), "mid-40-reversed");
  EXPECT_EQ(near_miss("avai", names), "avia");
}

TEST(NearMiss, IsSilentWhereNothingIsNear) {
  const std::vector<std::string> names{"avia", "horizon"};
  EXPECT_EQ(near_miss("velodyne", names), "");
  EXPECT_EQ(near_miss("", names), "");
  EXPECT_EQ(near_miss(std::string(1000, 'a'), names), "");
  EXPECT_EQ(near_miss("avia", {}), "");
}

}  // namespace risley::text_test
