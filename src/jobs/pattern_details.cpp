// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/pattern_details.hpp"

#include <cmath>
#include <numeric>

#include "risley/jobs/compare_results.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::jobs {
namespace {

constexpr double kMostDrawn = 25'000;

}  // namespace

PatternDetails pattern_details(const GivenSensor& sensor, const sensors::ScanPatternOptions& scan,
                               const sensors::CoverageOptions& coverage, const Progress& progress) {
  PatternDetails result;
  result.sensor = load_result(sensor);
  result.coverage = sensors::pattern_coverage(result.sensor, scan, coverage, progress);
  const double rate = scan.shot_rate.value_or(result.sensor.shot_rate);
  const double rows = coverage.after.back() * rate / static_cast<double>(scan.every);
  // No common factor with the number of emitters, or only some of them would be visible.
  auto thinning = static_cast<std::uint64_t>(std::ceil(rows / kMostDrawn));
  while (std::gcd(thinning, static_cast<std::uint64_t>(result.sensor.train.emitters())) != 1) {
    ++thinning;
  }
  sensors::ScanPatternOptions thinned = scan;
  thinned.every = result.rosette_every = scan.every * thinning;
  result.rosette = sensors::scan_pattern(
      result.sensor, 0, static_cast<std::size_t>(rows / static_cast<double>(thinning)), thinned);
  return result;
}

}  // namespace risley::jobs
