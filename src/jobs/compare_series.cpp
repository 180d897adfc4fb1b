// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/compare_series.hpp"

#include <utility>

#include "risley/core/require.hpp"

namespace risley::jobs {

ComparedSeries compare_series(const CompareSeriesOptions& options, const Progress& progress) {
  require_at_least("number of results", static_cast<long long>(options.results.size()), 2);
  require_between("option false_alarm", options.false_alarm, 0, 1);
  std::vector<std::pair<std::size_t, std::size_t>> places;
  for (std::size_t b = 1; b < options.results.size(); ++b) {
    places.emplace_back(b - 1, b);
    if (b > 1) places.emplace_back(0, b);
  }
  ComparedSeries series{options.results, options.false_alarm, 0, {}};
  series.least_p_value = options.false_alarm / static_cast<double>(places.size());
  series.pairs.reserve(places.size());
  for (const auto& [a, b] : places) {
    progress.report(static_cast<double>(series.pairs.size()) / static_cast<double>(places.size()));
    ComparedPair pair{
        a, b, compare_results(options.results[a], options.results[b], OneUnit::caller), false};
    pair.changed = pair.comparison.change.degrees_of_freedom > 0 &&
                   pair.comparison.change.p_value < series.least_p_value;
    series.pairs.push_back(std::move(pair));
  }
  return series;
}

}  // namespace risley::jobs
