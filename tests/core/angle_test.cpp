// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/angle.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace risley::angle_test {

TEST(Angle, WrapsIntoOneTurn) {
  EXPECT_EQ(wrap_to_two_pi(0.0), 0.0);
  EXPECT_DOUBLE_EQ(wrap_to_two_pi(-0.5), kTwoPi - 0.5);
  EXPECT_NEAR(wrap_to_two_pi(3.0 * kTwoPi + 0.25), 0.25, 1e-14);
  EXPECT_EQ(wrap_to_two_pi(-1e-300), 0.0);  // rounds up to a full turn
  EXPECT_NEAR(wrap_to_pi(kTwoPi - 0.5), -0.5, 1e-15);
}

TEST(Angle, NextToFullTurnsStaysWithinOne) {
  for (int turns = -1000; turns <= 1000; ++turns) {
    for (const double towards : {-1e9, 1e9}) {
      const double angle = std::nextafter(turns * kTwoPi, towards);
      EXPECT_GE(wrap_to_two_pi(angle), 0.0) << angle;
      EXPECT_LT(wrap_to_two_pi(angle), kTwoPi) << angle;
    }
  }
  EXPECT_GE(wrap_to_two_pi(106.81415022205296), 0.0);  // a little less than 17 turns
}

TEST(Angle, WhatIsNoAngleStaysNoAngle) {
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
        -std::numeric_limits<double>::infinity()}) {
    EXPECT_TRUE(std::isnan(wrap_to_two_pi(value))) << value;
    EXPECT_TRUE(std::isnan(wrap_to_pi(value))) << value;
  }
}

}  // namespace risley::angle_test
