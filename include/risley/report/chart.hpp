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

/// An unknown value: a gap in a line.
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// How a series is drawn.
enum class SeriesKind {
  points,
  line,
  steps,
  cells,  ///< rectangles about x and y, coloured by value
};

/// Kind of the axes of a diagram.
enum class ChartKind {
  plain,
  full_turn,  ///< x runs from 0 to 360 degree
  two_turns,  ///< square, both axes run from 0 to 360 degree
  map,        ///< square, equal scales, both axes reversed: a view along the beam
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
  std::vector<double> z = {};      ///< if the diagram has a third axis
  std::vector<double> value = {};  ///< quantity that colours points or cells; empty: all in one
                                   ///< colour
  std::vector<double> sigma = {};  ///< half the length of bars along y; empty: no bars
  double cell_width = 0, cell_height = 0;
};

/// One diagram with labelled axes.
struct Chart {
  std::string title, x_label, y_label;
  std::vector<Series> series;
  std::string note;  ///< under the diagram: how the data were thinned
  ChartKind kind = ChartKind::plain;
  bool dates = false;  ///< x is UTC since 1970, ms
  std::string z_label = {};
  std::string value_label = {};
  Palette palette = Palette::sequential;
  /// Values at the ends of the colours; without it the least and the greatest.
  std::optional<std::pair<double, double>> value_range = {};
  /// Duration in which the points of the first series were fired one after another, s; the page can
  /// animate it.
  std::optional<double> grows_for = {};
};

/// A diagram over azimuth and zenith in degrees as one looks out of the sensor: a map about X or,
/// of a sensor that scans all around, a panorama of azimuth and elevation.
Chart view_of_directions(Chart chart, bool all_around);

/// Diagrams in the form for pages and report.json; non-finite values are null. Columns keep seven
/// significant digits, and more if numbers differ little relative to their size, as the speeds of a
/// steady rotor do.
json::Json chart_json(const Chart& chart);
/// The same of several.
json::Json charts_json(const std::vector<Chart>& charts);

/// A diagram of chart_json() as a figure element, which page.js fills.
std::string figure_html(const json::Json& chart, std::size_t number);
/// JSON that is safe inside a script element.
std::string json_in_script(const json::Json& json);
/// The data of figure_html()'s diagram for page.js.
std::string script_text(json::Json chart, std::size_t number);

/// Value of a row.
using Column = std::function<double(std::size_t)>;

/// The rows kept when thinning to a largest number of points: all, or each n-th.
std::vector<std::size_t> every_nth(std::size_t rows, std::size_t most);
/// The same in words.
std::string every_nth_note(std::size_t rows, std::size_t most, std::string_view what = "shots");

/// A line that keeps peaks: of every bin of rows the smallest and the largest value, in their
/// order; short columns stay unchanged.
Series peak_line(std::string label, std::string colour, std::size_t rows, const Column& x,
                 const Column& y);
/// Which rows peak_line() draws, as a sentence.
std::string peak_line_note(std::size_t rows, std::string_view what);

/// Counts per bin within 4.5 standard deviations of the mean (9 to 61 bins, by the cube root of the
/// number of values), and the normal curve of the same mean, deviation and count. Values beyond are
/// counted in the outermost bins.
std::vector<Series> histogram(const std::string& label, const std::string& colour,
                              std::span<const double> values, std::span<const unsigned char> skip,
                              const estimation::Moments& moments, double scale);

}  // namespace risley::report
