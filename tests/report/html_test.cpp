// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/html.hpp"

#include <gtest/gtest.h>

namespace risley::report::html_test {

TEST(Html, EscapesWhatHtmlReads) {
  EXPECT_EQ(escape_html("<a href=\"x\">&'</a>"),
            "&lt;a href=&quot;x&quot;&gt;&amp;&#39;&lt;/a&gt;");
}

TEST(Html, CountsStandInGroupsOfThree) {
  EXPECT_EQ(count_text(0), "0");
  EXPECT_EQ(count_text(999), "999");
  EXPECT_EQ(count_text(1000), "1\u202f000");
  EXPECT_EQ(count_text(12345678), "12\u202f345\u202f678");
}

}  // namespace risley::report::html_test
