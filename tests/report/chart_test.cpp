// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/chart.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include <gtest/gtest.h>

namespace risley::report::chart_test {

TEST(Charts, APeakSurvivesThinning) {
  constexpr std::size_t kRows = 100000, kPeak = 54321, kDip = 77777;
  const Series line = peak_line(
      "", "a", kRows, [](std::size_t i) { return double(i); },
      [](std::size_t i) { return i == kPeak ? 5.0 : (i == kDip ? -7.0 : 0.0); });
  EXPECT_LT(line.x.size(), 1300u);
  EXPECT_EQ(*std::max_element(line.y.begin(), line.y.end()), 5.0);
  EXPECT_EQ(*std::min_element(line.y.begin(), line.y.end()), -7.0);
  EXPECT_TRUE(std::is_sorted(line.x.begin(), line.x.end()));
}

TEST(Charts, APeakSurvivesShotsWithoutAValue) {
  constexpr std::size_t kRows = 60000, kBin = 100, kPeak = 54321, kDip = 45678;
  const Series line = peak_line(
      "", "a", kRows, [](std::size_t i) { return double(i); },
      [](std::size_t i) {
        if (i % kBin == 0) return std::numeric_limits<double>::quiet_NaN();
        return i == kPeak ? 5.0 : (i == kDip ? -7.0 : 0.0);
      });
  EXPECT_EQ(std::count(line.y.begin(), line.y.end(), 5.0), 1);
  EXPECT_EQ(std::count(line.y.begin(), line.y.end(), -7.0), 1);
}

TEST(Charts, AShortLineIsDrawnWhole) {
  const Series line = peak_line(
      "", "a", 700, [](std::size_t i) { return double(i); }, [](std::size_t) { return 1.0; });
  EXPECT_EQ(line.x.size(), 700u);
}

TEST(Charts, EveryNthKeepsAtMostSoManyAndTellsIt) {
  EXPECT_EQ(every_nth(10, 4), (std::vector<std::size_t>{0, 3, 6, 9}));
  EXPECT_EQ(every_nth(3, 4).size(), 3u);
  EXPECT_EQ(every_nth_note(10, 4), "One in 3 of the 10 shots is drawn.");
  EXPECT_EQ(every_nth_note(3, 4, "outliers"), "All 3 outliers are drawn.");
}

TEST(Charts, AHistogramCountsEveryUsedValue) {
  const std::vector<double> values = {-1.0, -0.5, 0.0, 0.5, 1.0, 100.0, 3.0};
  const std::vector<unsigned char> skip = {0, 0, 0, 0, 0, 0, 1};
  const estimation::Moments moments{6, 0.0, 1.0, 1.0, 0.0, 0.0};
  const auto series = histogram("", "a", values, skip, moments, 1.0);
  ASSERT_EQ(series.size(), 2u);
  EXPECT_EQ(std::accumulate(series[0].y.begin(), series[0].y.end(), 0.0), 6.0);
  EXPECT_EQ(series[0].y.back(), 1.0);  // the one far beyond
  // The normal curve holds as many shots as the histogram.
  double area = 0;
  for (std::size_t i = 1; i < series[1].x.size(); ++i) {
    area += (series[1].x[i] - series[1].x[i - 1]) * 0.5 * (series[1].y[i] + series[1].y[i - 1]);
  }
  EXPECT_NEAR(area / (series[0].x[1] - series[0].x[0]), 6.0, 1e-3);
}

TEST(Charts, AHistogramHasBinsForItsValues) {
  const estimation::Moments moments{1, 0.0, 1.0, 1.0, 0.0, 0.0};
  const auto bins = [&](std::size_t count) {
    return histogram("", "a", std::vector<double>(count, 0.1), {}, moments, 1.0)[0].x.size();
  };
  EXPECT_EQ(bins(30), 9u);
  EXPECT_EQ(bins(1001), 21u);
  EXPECT_EQ(bins(3000000), 61u);
}

json::Json drawn(std::vector<double> x) {
  return chart_json(
      {"a \"title\" </script>", "x", "y", {{"", "a", SeriesKind::line, std::move(x), {}}}, {}});
}

TEST(ChartJson, TextsCannotEndTheScriptElement) {
  const std::string text = script_text(drawn({}), 3);
  EXPECT_NE(text.find(R"("title":"a \"title\" \u003c/script>")"), std::string::npos) << text;
  EXPECT_EQ(text.find('<'), std::string::npos);
  EXPECT_EQ(json::Json::parse(text)["title"], "a \"title\" </script>");
  EXPECT_EQ(json::Json::parse(text)["id"], "chart-3");
}

TEST(ChartJson, NumbersThatAreNotFiniteBecomeNull) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::string text =
      drawn({1.5, std::numeric_limits<double>::quiet_NaN(), -2e-7, kInfinity, 0.25}).dump();
  EXPECT_NE(text.find("\"x\":[1.5,null,-2e-07,null,0.25]"), std::string::npos) << text;
  EXPECT_NE(text.find("\"y\":[]"), std::string::npos) << text;
}

TEST(ChartJson, NumbersThatDifferLittleKeepWhatTellsThemApart) {
  const auto column = [](std::vector<double> x) { return drawn(std::move(x))["series"][0]["x"]; };
  EXPECT_EQ(column({1.0 / 3.0, -1.0}), (json::Json{0.3333333, -1.0}));
  EXPECT_EQ(column({-43789.81234567, -43789.81234568}),
            (json::Json{-43789.81234567, -43789.81234568}));
}

}  // namespace risley::report::chart_test
