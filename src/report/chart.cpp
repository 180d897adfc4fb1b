// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/chart.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/report/html.hpp"

namespace risley::report {

using json::Json;

namespace {

constexpr std::size_t kLineBins = 600;
constexpr double kFewestBins = 9, kMostBins = 61;  // of a histogram
constexpr double kHistogramHalfWidth = 4.5;        // standard deviations

std::size_t stride_for(std::size_t rows, std::size_t most) {
  return rows <= most ? 1 : (rows + most - 1) / most;
}

constexpr const char* kSeriesKinds[] = {"points", "line", "steps", "cells"};
constexpr const char* kChartKinds[] = {"plain",    "full_turn", "two_turns", "map",
                                       "panorama", "ground",    "space"};
constexpr const char* kPalettes[] = {"sequential", "diverging"};

int digits_of(const std::vector<double>& values) {
  constexpr int kDigits = 7, kMostDigits = 15;
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    least = std::min(least, value);
    greatest = std::max(greatest, value);
  }
  const double size = std::max(std::abs(least), std::abs(greatest)), spread = greatest - least;
  if (!(spread > 0) || !(size > spread)) return kDigits;
  return std::min(kDigits + static_cast<int>(std::ceil(std::log10(size / spread))), kMostDigits);
}

Json column_json(const std::vector<double>& values) {
  const int digits = digits_of(values);
  Json column = Json::array();
  for (const double value : values) {
    column.push_back(std::isfinite(value)
                         ? Json(std::strtod(fmt::format("{:.{}g}", value, digits).c_str(), nullptr))
                         : Json());
  }
  return column;
}

Json series_json(const Series& series) {
  Json object = {{"label", series.label},
                 {"colour", series.colour},
                 {"kind", kSeriesKinds[static_cast<std::size_t>(series.kind)]},
                 {"x", column_json(series.x)},
                 {"y", column_json(series.y)},
                 {"z", column_json(series.z)},
                 {"value", column_json(series.value)},
                 {"cell_width", series.cell_width},
                 {"cell_height", series.cell_height}};
  if (!series.sigma.empty()) object["sigma"] = column_json(series.sigma);
  return object;
}

template <class Value>
Json if_any(const std::optional<Value>& value) {
  return value ? Json(*value) : Json();
}

}  // namespace

Chart view_of_directions(Chart chart, bool all_around) {
  chart.kind = all_around ? ChartKind::panorama : ChartKind::map;
  chart.x_label = "azimuth, deg";
  chart.y_label = all_around ? "elevation, deg" : "zenith, deg";
  if (!all_around) return chart;
  for (Series& series : chart.series) {
    for (double& y : series.y) y = 90 - y;
  }
  return chart;
}

Json chart_json(const Chart& chart) {
  Json object = {{"title", chart.title},
                 {"kind", kChartKinds[static_cast<std::size_t>(chart.kind)]},
                 {"x_label", chart.x_label},
                 {"y_label", chart.y_label},
                 {"z_label", chart.z_label},
                 {"value_label", chart.value_label},
                 {"palette", kPalettes[static_cast<std::size_t>(chart.palette)]},
                 {"value_range", if_any(chart.value_range)},
                 {"grows_for", if_any(chart.grows_for)},
                 {"note", chart.note},
                 {"series", Json::array()}};
  if (chart.dates) object["dates"] = true;
  for (const Series& series : chart.series) object["series"].push_back(series_json(series));
  return object;
}

Json charts_json(const std::vector<Chart>& charts) {
  Json list = Json::array();
  for (const Chart& chart : charts) list.push_back(chart_json(chart));
  return list;
}

std::string figure_html(const Json& chart, std::size_t number) {
  const auto text = [&](const char* key) { return escape_html(chart.value(key, "")); };
  std::string html = fmt::format(
      "<figure class=\"{0}\"><figcaption>{1}</figcaption>\n<div class=\"plot\" id=\"chart-{2}\" "
      "role=\"img\" tabindex=\"0\" aria-label=\"{1}: {3} over {4}\"></div>",
      text("kind"), text("title"), number, text("y_label"), text("x_label"));
  if (!text("note").empty()) html += fmt::format("\n<p class=\"note\">{}</p>", text("note"));
  return html + "</figure>\n";
}

std::string json_in_script(const Json& json) {
  std::string safe;
  for (const char c : json.dump(-1, ' ', false, Json::error_handler_t::replace)) {
    if (c == '<') {  // only texts contain it, and "</script>" must not end the element
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe;
}

std::string script_text(Json chart, std::size_t number) {
  chart["id"] = fmt::format("chart-{}", number);
  return json_in_script(chart);
}

std::vector<std::size_t> every_nth(std::size_t rows, std::size_t most) {
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < rows; i += stride_for(rows, most)) kept.push_back(i);
  return kept;
}

std::string every_nth_note(std::size_t rows, std::size_t most, std::string_view what) {
  const std::size_t stride = stride_for(rows, most);
  if (stride == 1) return fmt::format("All {} {} are drawn.", count_text(rows), what);
  return fmt::format("One in {2} of the {0} {1} is drawn.", count_text(rows), what, stride);
}

Series peak_line(std::string label, std::string colour, std::size_t rows, const Column& x,
                 const Column& y) {
  Series series{std::move(label), std::move(colour), SeriesKind::line, {}, {}};
  const auto add = [&](std::size_t row) {
    series.x.push_back(x(row));
    series.y.push_back(y(row));
  };
  const std::size_t bin = stride_for(rows, kLineBins);
  if (bin <= 2) {
    for (std::size_t i = 0; i < rows; ++i) add(i);
    return series;
  }
  for (std::size_t first = 0; first < rows; first += bin) {
    std::size_t lowest = first, highest = first;
    for (std::size_t i = first; i < std::min(first + bin, rows); ++i) {
      if (!(y(i) >= y(lowest))) lowest = i;
      if (!(y(i) <= y(highest))) highest = i;
    }
    add(std::min(lowest, highest));
    if (lowest != highest) add(std::max(lowest, highest));
  }
  return series;
}

std::string peak_line_note(std::size_t rows, std::string_view what) {
  const std::size_t bin = stride_for(rows, kLineBins);
  if (bin <= 2) return fmt::format("All {} {} are drawn.", count_text(rows), what);
  return fmt::format("The smallest and the largest value of every {} of the {} {} are drawn.", bin,
                     count_text(rows), what);
}

std::vector<Series> histogram(const std::string& label, const std::string& colour,
                              std::span<const double> values, std::span<const unsigned char> skip,
                              const estimation::Moments& moments, double scale) {
  Series counts{label, colour, SeriesKind::steps, {}, {}};
  Series curve{"normal curve", "ink", SeriesKind::line, {}, {}};
  if (!(moments.std > 0)) return {counts};
  // Rice's rule, and an odd number so that the mean stands in the middle of a bin.
  const double rule = std::floor(std::cbrt(double(values.size())));
  const auto bins = static_cast<std::size_t>(std::clamp(2 * rule + 1, kFewestBins, kMostBins));
  const double width = 2 * kHistogramHalfWidth * moments.std / double(bins);
  const double first = moments.mean - kHistogramHalfWidth * moments.std;
  counts.y.assign(bins, 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if ((!skip.empty() && skip[i] != 0) || !std::isfinite(values[i])) continue;
    const double bin = std::clamp(std::floor((values[i] - first) / width), 0.0, double(bins - 1));
    counts.y[static_cast<std::size_t>(bin)] += 1.0;
  }
  for (std::size_t i = 0; i < bins; ++i) {
    counts.x.push_back(scale * (first + (double(i) + 0.5) * width));
  }
  constexpr int kCurvePoints = 91;
  for (int i = 0; i < kCurvePoints; ++i) {
    const double z = kHistogramHalfWidth * (2.0 * i / (kCurvePoints - 1) - 1.0);
    curve.x.push_back(scale * (moments.mean + z * moments.std));
    curve.y.push_back(double(moments.count) * width / moments.std * std::exp(-0.5 * z * z) /
                      std::sqrt(kTwoPi));
  }
  return {counts, curve};
}

}  // namespace risley::report
