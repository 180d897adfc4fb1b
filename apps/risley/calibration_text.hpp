// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/calibration/calibrate.hpp"
#include "risley/calibration/calibration_plan.hpp"
#include "risley/report/report_facts.hpp"

#include "command.hpp"

namespace risley::app {

/// Errors of the beams' directions before and after, of all recordings together.
struct TruthErrors {
  calibration::DirectionErrors before, after;
  sensors::Sensor sensor;
  /// Computed minus true angles of the compared beams, rad.
  std::vector<double> azimuth_before, zenith_before, azimuth_after, zenith_after;
};

/// Everything one calibration found.
struct CalibrationOutcome {
  calibration::Calibration calibration;
  std::vector<std::string> recordings;  ///< as typed
  std::vector<report::ReportedRecording> reported;
  sensors::Sensor nominal;
  std::optional<TruthErrors> truth;
  std::vector<std::string> warnings;  ///< of the recordings
  std::uint64_t observations = 0;
  double read_s = 0, angles_s = 0, solve_s = 0, total_s = 0;
};

Json calibration_json(const CalibrationOutcome& outcome);
void print_calibration(const CalibrationOutcome& outcome);

Json forecast_json(const calibration::CalibrationForecast& forecast, int prisms);
void print_forecast(const calibration::CalibrationForecast& forecast, int prisms);

}  // namespace risley::app
