// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <vector>

#include "risley/report/chart.hpp"

namespace risley::reproduction {

/// One figure of the paper.
struct Figure {
  std::string name;   ///< "figure_7"
  std::string table;  ///< the table that it belongs to
  std::string title;
  std::vector<report::Chart> charts = {};
};

/// Counts of a sample and the normal curve of the same mean, deviation and count: how the paper
/// draws its samples. The note says count, mean and deviation.
/// @param scale  multiplies the values: units of the x axis per unit
report::Chart histogram_chart(std::string title, std::string x_label,
                              std::span<const double> values, double scale = 1.0);

/// A series over azimuth and zenith, deg, in equal scales. Its label says what its values are, if
/// it has any. Their colours diverge from 0 where some are below; else they end at the 98th
/// percentile where a peak would leave few colours for the rest, and the note says so.
report::Chart field_of_view_chart(std::string title, report::Series series);

}  // namespace risley::reproduction
