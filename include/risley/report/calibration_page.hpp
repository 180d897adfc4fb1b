// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "risley/calibration/calibrate.hpp"
#include "risley/calibration/datum.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::report {

/// All that the page of one calibration shows. References must live until the page is made.
struct CalibrationPageInput {
  const calibration::Calibration& calibration;
  const sensors::Sensor& nominal;  ///< preset the calibration started from
  /// What is known of the truth.
  struct Truth {
    calibration::DirectionErrors before, after;  ///< of the beams of all recordings together
    std::optional<sensors::Sensor> sensor;
  };
  std::optional<Truth> truth;
  std::vector<std::string> recordings;  ///< file names [recordings]
  std::uint64_t observations = 0;       ///< rows of all recordings
  /// How to make it again: name and value pairs such as command, version, seed, input_sha256.
  std::vector<std::pair<std::string, std::string>> provenance;
  std::vector<std::string> warnings;  ///< beside those of the calibration
};

/// One self-contained HTML page (Chart.js included, no network): the verdict first, then
/// parameters, datum, walls, what is left of their thickness, views of the points, correlations
/// and provenance. It computes nothing but thinning, bins and means over cells of the sample, and
/// the page says where it thinned. What is not finite shows as a dash.
std::string calibration_page(const CalibrationPageInput& input);

}  // namespace risley::report
