// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/page_parts.hpp"

#include <string>

#include <gtest/gtest.h>

namespace risley::report::page_parts_test {

TEST(Sections, ContentsLeadToEach) {
  Sections sections;
  sections.add("Do the parameters <stand> still?", "<p>yes</p>\n", Sections::Shown::unfolded);
  sections.add("Nothing", "");
  sections.add("Table 3", "<p>rows</p>\n", "table_3", "4 of 4 rows pass");
  EXPECT_EQ(sections.html(),
            "<nav class=\"contents\" aria-label=\"Contents\">\n<ul>\n"
            "<li><a href=\"#do-the-parameters-stand-still-\">Do the parameters &lt;stand&gt; "
            "still?</a></li>\n<li><a href=\"#table_3\">Table 3</a>: 4 of 4 rows pass</li>\n</ul>\n"
            "<button id=\"unfold\" type=\"button\">Unfold all</button>\n</nav>\n"
            "<details class=\"section\" id=\"do-the-parameters-stand-still-\" open>\n"
            "<summary><h2>Do the parameters &lt;stand&gt; still?</h2></summary>\n<p>yes</p>\n"
            "</details>\n<details class=\"section\" id=\"table_3\">\n"
            "<summary><h2>Table 3</h2></summary>\n<p>rows</p>\n</details>\n");
  EXPECT_EQ(Sections().html(), "");
}

}  // namespace risley::report::page_parts_test
