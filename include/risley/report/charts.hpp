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
#include "risley/report/chart.hpp"

namespace risley::report {

/// A diagram as a figure element, which page.js fills.
std::string figure_html(const Chart& chart, std::size_t number);
/// The data of figure_html()'s diagram for page.js: JSON that may stand inside a script element.
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
/// Which rows peak_line() draws of so many shots, as a sentence.
std::string peak_line_note(std::size_t rows);

/// Counts per bin within 4.5 standard deviations of the mean (9 to 61 bins, by the cube root of the
/// number of values), and the normal curve of the same mean, deviation and count. Values beyond
/// stand in the outermost bins.
std::vector<Series> histogram(const std::string& label, const std::string& colour,
                              std::span<const double> values, std::span<const unsigned char> skip,
                              const estimation::Moments& moments, double scale);

}  // namespace risley::report
