// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/html.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace risley::report {
namespace {

TEST(Html, EscapesWhatHtmlReads) {
  EXPECT_EQ(escape_html("<a href=\"x\">&'</a>"),
            "&lt;a href=&quot;x&quot;&gt;&amp;&#39;&lt;/a&gt;");
}

TEST(Html, JsonCannotEndItsScriptElement) {
  EXPECT_EQ(json_string("</script>"), "\"\\u003c/script>\"");
  EXPECT_EQ(json_string("a\"b"), "\"a\\\"b\"");
}

TEST(Html, NumbersThatAreNotFiniteBecomeNull) {
  EXPECT_EQ(json_numbers({1.5, std::numeric_limits<double>::quiet_NaN(), -2e-7,
                          std::numeric_limits<double>::infinity()}),
            "[1.5,null,-2e-07,null]");
  EXPECT_EQ(json_numbers({}), "[]");
}

TEST(Html, NumbersThatDifferLittleKeepWhatTellsThemApart) {
  EXPECT_EQ(json_numbers({1.0 / 3.0, -1.0}), "[0.3333333,-1]");
  EXPECT_EQ(json_numbers({-43789.81234567, -43789.81234568}), "[-43789.81234567,-43789.81234568]");
  EXPECT_EQ(digits_of({5.0, 5.0}), 7);
  EXPECT_EQ(digits_of({-1.0, 1.0}), 7);
  EXPECT_EQ(digits_of({1.5090001, 1.5090002}), 15);
  EXPECT_EQ(digits_of({}), 7);
}

TEST(Html, CountsStandInGroupsOfThree) {
  EXPECT_EQ(count_text(0), "0");
  EXPECT_EQ(count_text(999), "999");
  EXPECT_EQ(count_text(1000), "1\u202f000");
  EXPECT_EQ(count_text(12345678), "12\u202f345\u202f678");
}

}  // namespace
}  // namespace risley::report
