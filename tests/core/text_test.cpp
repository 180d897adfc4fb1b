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

TEST(NearMiss, FindsANameByItsBeginning) {
  const std::vector<std::string> names{"--noise-angle-deg", "--noise-range-m", "wedge_angle_deg"};
  EXPECT_EQ(near_miss("--noise", names), "--noise-angle-deg");
  EXPECT_EQ(near_miss("wedge", names), "wedge_angle_deg");
  EXPECT_EQ(near_miss("--noi", names), "");  // not up to a mark
  EXPECT_EQ(did_you_mean("wedge", names), ", did you mean wedge_angle_deg?");
  EXPECT_EQ(did_you_mean("lens", names), "");
}

TEST(NearMiss, IsSilentWhereNothingIsNear) {
  const std::vector<std::string> names{"avia", "horizon"};
  EXPECT_EQ(near_miss("velodyne", names), "");
  EXPECT_EQ(near_miss("", names), "");
  EXPECT_EQ(near_miss(std::string(1000, 'a'), names), "");
  EXPECT_EQ(near_miss("avia", {}), "");
}

TEST(Printable, ShowsWhatATerminalWouldObey) {
  EXPECT_EQ(printable("\033[31mred\033]0;title\a", true), "\\u001b[31mred\\u001b]0;title\\u0007");
  EXPECT_EQ(printable("C1 \xc2\x9b as UTF-8, \x9b alone", true),
            "C1 \\u009b as UTF-8, \\x9b alone");
  EXPECT_EQ(printable("a\tb\nc\rd\x7f", true), "a\tb\nc\\u000dd\\u007f");
  EXPECT_EQ(printable("a\nb", false), "a\\u000ab");
  EXPECT_EQ(printable("turned \xe2\x80\xae back", true), "turned \\u202e back");
  EXPECT_EQ(printable(std::string("zero\0", 5), true), "zero\\u0000");
}

TEST(Printable, LeavesOtherTextsAlone) {
  const std::string text = "σ ± 0.5°, 国, \xf0\x9f\x98\x80 and plain\n";
  EXPECT_EQ(printable(text, true), text);
}

TEST(Printable, ShowsBytesThatAreNoText) {
  EXPECT_EQ(printable("\xff\xc3", true), "\\xff\\xc3");
  EXPECT_EQ(printable("\xe2\x82", true), "\\xe2\\x82");           // cut off
  EXPECT_EQ(printable("\xc0\x9b", true), "\\xc0\\x9b");           // longer than need be
  EXPECT_EQ(printable("\xed\xa0\x80", true), "\\xed\\xa0\\x80");  // half a pair of UTF-16
}

}  // namespace risley::text_test
