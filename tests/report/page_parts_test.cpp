// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/page_parts.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace risley::report::page_parts_test {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Sections, ContentsLeadToEach) {
  Sections sections;
  sections.add("Do the parameters <stand> still?", "<p>yes</p>\n", Sections::Shown::unfolded);
  sections.add("Nothing", "");
  sections.add("Table 3", "<p>rows</p>\n", "table_3", "4 of 4 rows pass");
  const std::string html = sections.html();
  EXPECT_THAT(html, HasSubstr("<li><a href=\"#do-the-parameters-stand-still-\">Do the parameters "
                              "&lt;stand&gt; still?</a></li>"));
  EXPECT_THAT(html, HasSubstr("id=\"do-the-parameters-stand-still-\" open>"));
  EXPECT_THAT(html, HasSubstr("<a href=\"#table_3\">Table 3</a>: 4 of 4 rows pass</li>"));
  EXPECT_THAT(html, HasSubstr("<details class=\"section\" id=\"table_3\">"));
  EXPECT_THAT(html, Not(HasSubstr("Nothing")));
  EXPECT_EQ(Sections().html(), "");
}

}  // namespace risley::report::page_parts_test
