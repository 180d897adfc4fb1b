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

TEST(Angle, WhatIsNoAngleStaysNoAngle) {
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
        -std::numeric_limits<double>::infinity()}) {
    EXPECT_TRUE(std::isnan(wrap_to_two_pi(value))) << value;
    EXPECT_TRUE(std::isnan(wrap_to_pi(value))) << value;
  }
}

}  // namespace risley::angle_test
