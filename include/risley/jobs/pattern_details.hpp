// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "risley/core/progress.hpp"
#include "risley/jobs/given.hpp"
#include "risley/sensors/pattern_coverage.hpp"
#include "risley/sensors/scan_pattern.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// Contents of a page on a scan pattern.
struct PatternDetails {
  sensors::Sensor sensor;
  sensors::PatternCoverage coverage;
  /// The first shots, as long as the longest integration time, thinned for drawing.
  sensors::ScanPattern rosette;
  std::uint64_t rosette_every = 1;  ///< one of this many shots is drawn
};

/// @param sensor  as sensors::load_sensor()
/// @throws as load_result() and sensors::pattern_coverage()
PatternDetails pattern_details(const GivenSensor& sensor, const sensors::ScanPatternOptions& scan,
                               const sensors::CoverageOptions& coverage,
                               const Progress& progress = {});

}  // namespace risley::jobs
