// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/jobs/compare_results.hpp"

namespace risley::jobs {

/// The results that are compared, and how rarely chance may be taken for a change.
struct CompareSeriesOptions {
  std::vector<std::string> results;  ///< as compare_results(), at least two, in order of time
  /// Probability that at least one pair of a series in which nothing changed is called changed.
  double false_alarm = 0.01;
};

/// One pair of a series.
struct ComparedPair {
  std::size_t a = 0, b = 0;  ///< places in CompareSeriesOptions::results
  ResultComparison comparison;
  bool changed = false;
};

/// "changed", "no change seen", or "no sigmas to test with".
std::string answer_words(const ComparedPair& pair);

/// A unit over time, or units against each other.
struct ComparedSeries {
  std::vector<std::string> results;
  double false_alarm = 0;
  double least_p_value = 0;  ///< false_alarm over the number of pairs: changed is what lies below
  std::vector<ComparedPair> pairs;
};

/// Compares each result with the one before it and, from the third on, with the first. Results
/// whose serial numbers are not known count as one unit's.
/// @throws InvalidArgument for fewer than two results, a false alarm outside of 0 to 1, and as
///         compare_results(); FileError; Cancelled
ComparedSeries compare_series(const CompareSeriesOptions& options, const Progress& progress = {});

}  // namespace risley::jobs
