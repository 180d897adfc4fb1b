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

}  // namespace
}  // namespace risley::report
