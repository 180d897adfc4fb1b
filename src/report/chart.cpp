// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/chart.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/report/html.hpp"

#include "report/chart_fields.hpp"

namespace risley::report {
namespace {

constexpr std::size_t kLineBins = 600;
constexpr double kFewestBins = 9, kMostBins = 61;  // of a histogram
constexpr double kHistogramHalfWidth = 4.5;        // standard deviations

std::size_t stride_for(std::size_t rows, std::size_t most) {
  return rows <= most ? 1 : (rows + most - 1) / most;
}

}  // namespace

std::string figure_html(const Chart& chart, std::size_t number) {
  const std::string title = escape_html(chart.title);
  std::string html = fmt::format(
      "<figure class=\"{}\"><figcaption>{}</figcaption>\n<div class=\"plot\" id=\"chart-{}\" "
      "role=\"img\" tabindex=\"0\" aria-label=\"{}: {} over {}\"></div>",
      enum_names(chart.kind)[static_cast<std::size_t>(chart.kind)], title, number, title,
      escape_html(chart.y_label), escape_html(chart.x_label));
  if (!chart.note.empty())
    html += fmt::format("\n<p class=\"note\">{}</p>", escape_html(chart.note));
  return html + "</figure>\n";
}

std::string chart_json(const Chart& chart, std::size_t number) {
  Json object = to_json(chart);
  object["id"] = fmt::format("chart-{}", number);
  std::string safe;
  for (const char c : object.dump(-1, ' ', false, Json::error_handler_t::replace)) {
    if (c == '<') {  // only texts hold it, and "</script>" must not end the element
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe;
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

std::string peak_line_note(std::size_t rows) {
  const std::size_t bin = stride_for(rows, kLineBins);
  if (bin <= 2) return fmt::format("All {} shots are drawn.", count_text(rows));
  return fmt::format("The smallest and the largest value of every {} of the {} shots are drawn.",
                     bin, count_text(rows));
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
