// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "risley/estimation/diagnostics.hpp"

namespace risley::report {

/// How page.js draws a series.
enum class SeriesKind { points, line, steps };

/// What the axes of a diagram are.
enum class ChartKind {
  plain,
  full_turn,  ///< x runs from 0 to 360 degree
  map,        ///< square, equal scales, both axes turned: a view along the beam
};

/// One drawn series.
struct Series {
  std::string label;
  std::string colour;  ///< a colour of page.css: "a", "b", "c", "d", "ink", "bad"
  SeriesKind kind = SeriesKind::points;
  std::vector<double> x, y;
};

/// One diagram with labelled axes.
struct Chart {
  std::string title, x_label, y_label;
  std::vector<Series> series;
  std::string note;  ///< under the diagram: what was thinned
  ChartKind kind = ChartKind::plain;
};

/// A diagram as a figure element, and its data as a JSON object that page.js draws.
std::string figure_html(const Chart& chart, std::size_t number);
std::string chart_json(const Chart& chart, std::size_t number);

/// Value of a row.
using Column = std::function<double(std::size_t)>;

/// Every row that a thinning to at most so many points keeps: all, or each n-th.
std::vector<std::size_t> every_nth(std::size_t rows, std::size_t most);
/// The same in words.
std::string every_nth_note(std::size_t rows, std::size_t most, std::string_view what = "shots");

/// A line that keeps peaks: of every bin of rows the smallest and the largest value, in the order
/// they stand; short columns stay as they are.
Series peak_line(std::string label, std::string colour, std::size_t rows, const Column& x,
                 const Column& y);
std::string peak_line_note(std::size_t rows);

/// Counts per bin within 4.5 standard deviations of the mean, and the normal curve of the same
/// mean, deviation and count. Values beyond stand in the outermost bins.
std::vector<Series> histogram(const std::string& label, const std::string& colour,
                              std::span<const double> values, std::span<const unsigned char> skip,
                              const estimation::Moments& moments, double scale);

}  // namespace risley::report
