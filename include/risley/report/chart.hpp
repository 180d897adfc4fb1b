// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "risley/estimation/diagnostics.hpp"
#include "risley/json/results.hpp"

namespace risley::report {

/// A value that is not known: a gap in a line.
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// How a series is drawn.
enum class SeriesKind {
  points,
  line,
  steps,
  cells,  ///< rectangles about x and y, coloured by value
};

/// What the axes of a diagram are.
enum class ChartKind {
  plain,
  full_turn,  ///< x runs from 0 to 360 degree
  two_turns,  ///< square, both axes run from 0 to 360 degree
  map,        ///< square, equal scales, both axes turned: a view along the beam
  panorama,   ///< equal scales, x from 180 to -180 degree, y up: a view all around
  ground,     ///< square, equal scales: from above or from the side, x to the right, y up
  space,      ///< three axes of equal scale, can be rotated; points only
};

/// Colours of values.
enum class Palette {
  sequential,  ///< from few to many
  diverging,   ///< from below to above a middle
};

/// One drawn series.
struct Series {
  std::string label;
  std::string colour;  ///< of the page: "a", "b", "c", "d", "ink", "bad"
  SeriesKind kind = SeriesKind::points;
  std::vector<double> x, y;
  std::vector<double> z = {};      ///< where the diagram has a third axis
  std::vector<double> value = {};  ///< what colours points or cells; empty: all in one colour
  double cell_width = 0, cell_height = 0;
};

/// What colours the points of a diagram while the reader has chosen it.
struct Colouring {
  std::string label;
  std::vector<double> value;  ///< [points of the first series]; NaN: not known, not drawn
  std::optional<std::pair<double, double>> value_range = {};  ///< as Chart::value_range
};

/// One diagram with labelled axes.
struct Chart {
  std::string title, x_label, y_label;
  std::vector<Series> series;
  std::string note;  ///< under the diagram: what was thinned
  ChartKind kind = ChartKind::plain;
  std::string z_label = {};
  std::string value_label = {};
  Palette palette = Palette::sequential;
  /// Values that the ends of the colours stand for; without it the least and the greatest.
  std::optional<std::pair<double, double>> value_range = {};
  /// Seconds in which the points of the first series came one after another; the page can
  /// show how.
  std::optional<double> grows_for = {};
  /// Choices for the colours of the first series, instead of its values; the first is shown first.
  std::optional<std::vector<Colouring>> colourings = {};
};

/// A diagram over azimuth and zenith in degrees as one looks out of the sensor: a map about X or,
/// of a sensor that scans all around, a panorama of azimuth and elevation.
Chart view_of_directions(Chart chart, bool all_around);

/// Diagrams as pages and report.json have them; what is not finite is null. Columns keep seven
/// significant digits, and more where numbers differ little beside their size, as the speeds of a
/// steady rotor do.
json::Json chart_json(const Chart& chart);
/// The same of several.
json::Json charts_json(const std::vector<Chart>& charts);

/// A diagram of chart_json() as a figure element, which page.js fills.
std::string figure_html(const json::Json& chart, std::size_t number);
/// The data of figure_html()'s diagram for page.js: JSON that may stand inside a script element.
std::string script_text(json::Json chart, std::size_t number);

/// Value of a row.
using Column = std::function<double(std::size_t)>;

/// Every row that a thinning to a largest number of points keeps: all, or each n-th.
std::vector<std::size_t> every_nth(std::size_t rows, std::size_t most);
/// The same in words.
std::string every_nth_note(std::size_t rows, std::size_t most, std::string_view what = "shots");

/// A line that keeps peaks: of every bin of rows the smallest and the largest value, in the order
/// they stand; short columns stay as they are.
Series peak_line(std::string label, std::string colour, std::size_t rows, const Column& x,
                 const Column& y);
/// Which rows peak_line() draws, as a sentence.
std::string peak_line_note(std::size_t rows);

/// Counts per bin within 4.5 standard deviations of the mean (9 to 61 bins, by the cube root of the
/// number of values), and the normal curve of the same mean, deviation and count. Values beyond
/// stand in the outermost bins.
std::vector<Series> histogram(const std::string& label, const std::string& colour,
                              std::span<const double> values, std::span<const unsigned char> skip,
                              const estimation::Moments& moments, double scale);

}  // namespace risley::report
