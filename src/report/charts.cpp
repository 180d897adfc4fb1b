// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/charts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "risley/core/angle.hpp"

#include "report/html.hpp"

namespace risley::report {
namespace {

constexpr std::size_t kLineBins = 600;
constexpr std::size_t kHistogramBins = 61;
constexpr double kHistogramHalfWidth = 4.5;  // standard deviations

const char* kind_name(SeriesKind kind) {
  switch (kind) {
    case SeriesKind::line:
      return "line";
    case SeriesKind::steps:
      return "steps";
    case SeriesKind::points:
      break;
  }
  return "points";
}

const char* kind_name(ChartKind kind) {
  switch (kind) {
    case ChartKind::full_turn:
      return "full_turn";
    case ChartKind::map:
      return "map";
    case ChartKind::plain:
      break;
  }
  return "plain";
}

std::size_t stride_for(std::size_t rows, std::size_t most) {
  return rows <= most ? 1 : (rows + most - 1) / most;
}

}  // namespace

std::string figure_html(const Chart& chart, std::size_t number) {
  std::string html = fmt::format(
      "<figure{}><figcaption>{}</figcaption>\n<div class=\"plot\"><canvas id=\"chart-{}\" "
      "role=\"img\" aria-label=\"{}: {} over {}\"></canvas></div>",
      chart.kind == ChartKind::map ? " class=\"map\"" : "", escape_html(chart.title), number,
      escape_html(chart.title), escape_html(chart.y_label), escape_html(chart.x_label));
  if (!chart.note.empty())
    html += fmt::format("\n<p class=\"note\">{}</p>", escape_html(chart.note));
  return html + "</figure>\n";
}

std::string chart_json(const Chart& chart, std::size_t number) {
  std::string series;
  for (const Series& one : chart.series) {
    series +=
        fmt::format("{}{{\"label\":{},\"colour\":{},\"kind\":\"{}\",\"x\":{},\"y\":{}}}",
                    series.empty() ? "" : ",", json_string(one.label), json_string(one.colour),
                    kind_name(one.kind), json_numbers(one.x), json_numbers(one.y));
  }
  return fmt::format(
      "{{\"id\":\"chart-{}\",\"x_label\":{},\"y_label\":{},\"kind\":\"{}\",\"series\":[{}]}}",
      number, json_string(chart.x_label), json_string(chart.y_label), kind_name(chart.kind),
      series);
}

std::vector<std::size_t> every_nth(std::size_t rows, std::size_t most) {
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < rows; i += stride_for(rows, most)) kept.push_back(i);
  return kept;
}

std::string every_nth_note(std::size_t rows, std::size_t most, std::string_view what) {
  const std::size_t stride = stride_for(rows, most);
  if (stride == 1) return fmt::format("All {} {} are drawn.", rows, what);
  return fmt::format("Of {} {} one in {} is drawn.", rows, what, stride);
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

std::string peak_line_note(std::size_t rows) {
  const std::size_t bin = stride_for(rows, kLineBins);
  if (bin <= 2) return fmt::format("All {} shots are drawn.", rows);
  return fmt::format("Of every {} of {} shots the smallest and the largest value are drawn.", bin,
                     rows);
}

std::vector<Series> histogram(const std::string& label, const std::string& colour,
                              std::span<const double> values, std::span<const unsigned char> skip,
                              const estimation::Moments& moments, double scale) {
  Series counts{label, colour, SeriesKind::steps, {}, {}};
  Series curve{"normal curve", "ink", SeriesKind::line, {}, {}};
  if (!(moments.std > 0)) return {counts};
  const double width = 2 * kHistogramHalfWidth * moments.std / double(kHistogramBins);
  const double first = moments.mean - kHistogramHalfWidth * moments.std;
  counts.y.assign(kHistogramBins, 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if ((!skip.empty() && skip[i] != 0) || !std::isfinite(values[i])) continue;
    const double bin =
        std::clamp(std::floor((values[i] - first) / width), 0.0, double(kHistogramBins - 1));
    counts.y[static_cast<std::size_t>(bin)] += 1.0;
  }
  for (std::size_t i = 0; i < kHistogramBins; ++i) {
    const double middle = first + (double(i) + 0.5) * width;
    const double z = (middle - moments.mean) / moments.std;
    counts.x.push_back(scale * middle);
    curve.x.push_back(scale * middle);
    curve.y.push_back(double(moments.count) * width / moments.std * std::exp(-0.5 * z * z) /
                      std::sqrt(kTwoPi));
  }
  return {counts, curve};
}

}  // namespace risley::report
