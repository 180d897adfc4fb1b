// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/require.hpp"

#include <limits>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "refusal.hpp"

namespace risley::require_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(Require, NamesLengths) {
  EXPECT_EQ(refusal([] { require_length("azimuth", 4, 4); }), "");
  EXPECT_EQ(refusal([] { require_length("azimuth", 3, 4); }), "azimuth has 3 values, expected 4");
  EXPECT_EQ(refusal([] { require_length_or_none("skip", 0, 4); }), "");
  EXPECT_EQ(refusal([] { require_length_or_none("skip", 3, 4); }),
            "skip has 3 values, expected 4 or none");
}

TEST(Require, NamesPlacesAndRows) {
  EXPECT_EQ(refusal([] { require_place("knot", 6, 7); }), "");
  EXPECT_EQ(refusal([] { require_place("knot", 7, 7); }), "knot = 7, allowed 0 to 6");
  EXPECT_EQ(refusal([] { require_place("knot", 0, 0); }), "knot = 0, but there are none");
  EXPECT_EQ(refusal([] { require_rows("shots", 8, 8, 8); }), "");
  EXPECT_EQ(refusal([] { require_rows("shots", 3, 9, 8); }),
            "shots = [3, 9), allowed within [0, 8)");
  EXPECT_EQ(refusal([] { require_rows("shots", 3, 2, 8); }),
            "shots = [3, 2), allowed within [0, 8)");
  EXPECT_EQ(refusal([] { require_at_least("passes", 0, 1); }), "passes = 0, allowed 1 or more");
}

TEST(Require, NamesValuesUnitsAndRanges) {
  EXPECT_EQ(refusal([] { require_above("noise", 1e-9, 0, "rad"); }), "");
  EXPECT_EQ(refusal([] { require_above("noise", 0, 0, "rad"); }), "noise = 0 rad, allowed above 0");
  EXPECT_EQ(refusal([] { require_not_below("noise", 0, 0, "rad"); }), "");
  EXPECT_EQ(refusal([] { require_not_below("walk", -1.5, 0); }),
            "walk = -1.5, allowed 0 and above");
  EXPECT_EQ(refusal([] { require_between("share", 1, 0, 1); }), "");
  EXPECT_EQ(refusal([] { require_between("share", 2, 0, 1); }), "share = 2, allowed 0 to 1");
}

TEST(Require, AThresholdMayBeInfinite) {
  EXPECT_EQ(refusal([] { require_threshold("gate", kInfinite); }), "");
  EXPECT_EQ(refusal([] { require_threshold("gate", 0); }), "gate = 0, allowed above 0");
  EXPECT_EQ(refusal([] { require_threshold("gate", kNan); }), "gate = nan, allowed above 0");
}

TEST(Require, NeverAllowsWhatIsNoNumber) {
  for (const double value : {kNan, kInfinite, -kInfinite}) {
    EXPECT_NE(refusal([=] { require_above("x", value, 0); }), "") << value;
    EXPECT_NE(refusal([=] { require_not_below("x", value, 0); }), "") << value;
    EXPECT_NE(refusal([=] { require_between("x", value, 0, 1); }), "") << value;
    EXPECT_NE(refusal([=] { require_finite("x", value); }), "") << value;
  }
}

TEST(Require, UnitVectors) {
  EXPECT_EQ(refusal([] { require_unit_length("direction", 1 - 1e-7); }), "");
  for (const double length : {0.0, 2.0, 1 - 1e-5}) {
    EXPECT_EQ(refusal([=] { require_unit_length("direction", length); }),
              fmt::format("direction has length {}, expected a unit vector", length));
  }
  EXPECT_EQ(refusal([] { require_unit_length("direction", kNan); }),
            "direction has length nan, expected a unit vector");
}

}  // namespace risley::require_test
