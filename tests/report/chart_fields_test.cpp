// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/chart_fields.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "risley/report/chart.hpp"

namespace risley::report::chart_fields_test {

std::string drawn(std::vector<double> x) {
  return chart_json({"a \"title\" </script>", "x", "y", {{"", "a", SeriesKind::line, x, {}}}, {}},
                    3);
}

TEST(ChartFields, TextsCannotEndTheScriptElement) {
  const std::string json = drawn({});
  EXPECT_NE(json.find(R"("title":"a \"title\" \u003c/script>")"), std::string::npos) << json;
  EXPECT_EQ(json.find('<'), std::string::npos);
  EXPECT_EQ(Json::parse(json)["title"], "a \"title\" </script>");
  EXPECT_EQ(Json::parse(json)["id"], "chart-3");
}

TEST(ChartFields, NumbersThatAreNotFiniteBecomeNull) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::string json =
      drawn({1.5, std::numeric_limits<double>::quiet_NaN(), -2e-7, kInfinity, 0.25});
  EXPECT_NE(json.find("\"x\":[1.5,null,-2e-07,null,0.25]"), std::string::npos) << json;
  EXPECT_NE(json.find("\"y\":[]"), std::string::npos) << json;
}

TEST(ChartFields, NumbersThatDifferLittleKeepWhatTellsThemApart) {
  EXPECT_EQ(shortened({1.0 / 3.0, -1.0}), (std::vector<double>{0.3333333, -1.0}));
  EXPECT_EQ(shortened({-43789.81234567, -43789.81234568}),
            (std::vector<double>{-43789.81234567, -43789.81234568}));
  EXPECT_EQ(digits_of({5.0, 5.0}), 7);
  EXPECT_EQ(digits_of({-1.0, 1.0}), 7);
  EXPECT_EQ(digits_of({1.5090001, 1.5090002}), 15);
  EXPECT_EQ(digits_of({}), 7);
}

}  // namespace risley::report::chart_fields_test
