// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "reproduction/figure.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/random.hpp"

namespace risley::reproduction::figure_test {

TEST(HistogramChart, CountsEveryValueAndDrawsTheNormalCurve) {
  const RandomStream random(1, 2);
  std::vector<double> values(20000);
  random.fill_normal(0, values);
  const report::Chart chart = histogram_chart("a", "deg", values, 10.0);
  EXPECT_EQ(chart.title, "a");
  EXPECT_EQ(chart.x_label, "deg");
  EXPECT_EQ(chart.note.rfind("20\u202f000 values, mean ", 0), 0u) << chart.note;
  ASSERT_EQ(chart.series.size(), 2u);
  const auto& counts = chart.series[0].y;
  EXPECT_DOUBLE_EQ(std::accumulate(counts.begin(), counts.end(), 0.0), 20000.0);
  EXPECT_NEAR(chart.series[0].x.front(), -45.0, 2.0);
  const double highest = *std::max_element(counts.begin(), counts.end());
  const auto& normal = chart.series[1].y;
  EXPECT_NEAR(*std::max_element(normal.begin(), normal.end()), highest, 0.1 * highest);
}

TEST(HistogramChart, OfNothingIsEmpty) {
  for (const std::vector<double>& values : {std::vector<double>{}, std::vector<double>{1, 1, 1}}) {
    const report::Chart chart = histogram_chart("a", "deg", values);
    for (const report::Series& series : chart.series) EXPECT_TRUE(series.x.empty());
    EXPECT_TRUE(chart.note.empty());
  }
}

TEST(HistogramChart, OfFewValuesHasWideBins) {
  const RandomStream random(1, 2);
  std::vector<double> values(100);
  random.fill_normal(0, values);
  const report::Chart chart = histogram_chart("a", "deg", values);
  ASSERT_EQ(chart.series.size(), 2u);
  const report::Series& counts = chart.series[0];
  EXPECT_LT(counts.x.size(), 15u);
  EXPECT_DOUBLE_EQ(std::accumulate(counts.y.begin(), counts.y.end(), 0.0), 100.0);
  const auto highest = std::max_element(counts.y.begin(), counts.y.end()) - counts.y.begin();
  EXPECT_NEAR(counts.x[static_cast<std::size_t>(highest)], 0.0, 0.7);
  // Both enclose the same area.
  const auto& normal = chart.series[1];
  const double area = std::accumulate(normal.y.begin(), normal.y.end(), 0.0);
  EXPECT_NEAR(area * (normal.x[1] - normal.x[0]), 100.0 * (counts.x[1] - counts.x[0]), 1.0);
}

report::Series cells_of(std::vector<double> values) {
  report::Series cells{"mm", "a", report::SeriesKind::cells, {}, {}};
  cells.x.resize(values.size());
  cells.y.resize(values.size());
  cells.value = std::move(values);
  return cells;
}

TEST(FieldOfViewChart, ColoursDivergeFromZeroWhereValuesAreBelow) {
  const report::Chart chart = field_of_view_chart("a", cells_of({-1.0, 3.0, 2.0}));
  EXPECT_EQ(chart.kind, report::ChartKind::map);
  EXPECT_EQ(chart.palette, report::Palette::diverging);
  EXPECT_EQ(chart.value_range, std::make_pair(-3.0, 3.0));
  EXPECT_EQ(chart.value_label, "mm");
  EXPECT_TRUE(chart.note.empty());
}

TEST(FieldOfViewChart, APeakLeavesColoursForTheRest) {
  std::vector<double> values(101, 2.0);
  values[7] = 1.0;
  values[40] = 50.0;
  const report::Chart chart = field_of_view_chart("a", cells_of(values));
  EXPECT_EQ(chart.palette, report::Palette::sequential);
  EXPECT_EQ(chart.value_range, std::make_pair(1.0, 2.0));
  EXPECT_EQ(chart.note, "Colours end at 2; the highest value is 50.");
  values[40] = 3.0;
  EXPECT_FALSE(field_of_view_chart("a", cells_of(values)).value_range.has_value());
}

TEST(FieldOfViewChart, PointsWithoutValuesHaveNoColours) {
  const report::Series points{"shots", "a", report::SeriesKind::points, {1.0}, {90.0}};
  const report::Chart chart = field_of_view_chart("a", points);
  ASSERT_EQ(chart.series.size(), 1u);
  EXPECT_TRUE(chart.value_label.empty());
  EXPECT_FALSE(chart.value_range.has_value());
}

}  // namespace risley::reproduction::figure_test
