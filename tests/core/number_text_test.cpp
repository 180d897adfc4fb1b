// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/number_text.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace risley::number_text_test {

TEST(NumberText, ShowsTwoDigitsOfTheSigmaAndTheValueToTheSamePlace) {
  struct Case {
    double value, sigma;
    const char *value_text, *sigma_text;
  };
  const Case cases[] = {
      {1.50900361, 0.0000058, "1.5090036", "0.0000058"},
      {-43789.80085, 0.00045, "-43789.80085", "0.00045"},
      {0.123456, 0.0996, "0.12", "0.10"},  // the sigma's rounding moves its place
      {12.3, 0.995, "12.3", "1.0"},
      {1234.5, 37.2, "1234", "37"},
      {-0.0004, 0.14, "0.00", "0.14"},
      {-0.0096, 0.14, "-0.01", "0.14"},
      {1.25, 0.0, "1.25", ""},
      {-0.0, 0.0, "0", ""},
      {1.25, std::numeric_limits<double>::quiet_NaN(), "1.25", ""},
  };
  for (const Case& one : cases) {
    const NumberText text = number_text(one.value, one.sigma);
    EXPECT_EQ(text.value, one.value_text);
    EXPECT_EQ(text.sigma, one.sigma_text);
    EXPECT_EQ(text_to_place_of(one.value, one.sigma), one.value_text);
  }
}

TEST(PlainText, HasNoPowersOfTen) {
  EXPECT_EQ(plain_text(8.571e-5, 3), "0.0000857");
  EXPECT_EQ(plain_text(-7.9e-12, 2), "-0.0000000000079");
  EXPECT_EQ(plain_text(1e-5, 3), "0.00001");
  EXPECT_EQ(plain_text(0.40224, 3), "0.402");
  EXPECT_EQ(plain_text(123456.0, 3), "123000");
  EXPECT_EQ(plain_text(-0.0, 3), "0");
}

TEST(OffsetText, SaysHowFarAnAngleMovesAPointWithTwoDigits) {
  constexpr double kDegree = std::numbers::pi / 180;
  struct Case {
    double degrees, distance;
    const char* text;
  };
  const Case cases[] = {
      {0.0049, kStatedDistance, "2.6 mm at 30 m"},
      {-0.0049, kStatedDistance, "2.6 mm at 30 m"},  // a length has no sign
      {0.000077, kStatedDistance, "0.040 mm at 30 m"},
      {0.0512, kStatedDistance, "27 mm at 30 m"},
      {0.18995, kStatedDistance, "99 mm at 30 m"},
      {0.1901, kStatedDistance, "10 cm at 30 m"},  // 99.53 mm
      {0.40342, kStatedDistance, "21 cm at 30 m"},
      {1.8998, kStatedDistance, "1.0 m at 30 m"},  // 99.51 cm
      {3, kStatedDistance, "1.6 m at 30 m"},
      {45, kStatedDistance, "30 m at 30 m"},  // the tangent, not the angle
      {0, kStatedDistance, "0 mm at 30 m"},
      {0.0039, 82.4, "5.6 mm at 82 m"},
      {0.0039, 8.24, "0.56 mm at 8.2 m"},
      {std::numeric_limits<double>::quiet_NaN(), kStatedDistance, "–"},
      {0.0039, std::numeric_limits<double>::quiet_NaN(), "–"},
  };
  for (const Case& one : cases) {
    EXPECT_EQ(offset_text(one.degrees * kDegree, one.distance), one.text);
  }
  EXPECT_NEAR(offset_at(-0.1 * kDegree, 100), 0.174533, 1e-6);
  EXPECT_DOUBLE_EQ(offset_at(0.1), kStatedDistance * std::tan(0.1));
}

}  // namespace risley::number_text_test
