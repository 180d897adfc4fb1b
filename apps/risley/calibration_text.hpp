// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/calibration/calibrate.hpp"
#include "risley/calibration/calibration_plan.hpp"
#include "risley/report/calibration_report.hpp"

#include "command.hpp"

namespace risley::app {

/// Everything one calibration found.
struct CalibrationOutcome {
  calibration::Calibration calibration;
  std::vector<std::string> recordings;  ///< as typed
  std::vector<report::ReportedRecording> reported;
  sensors::Sensor nominal;
  std::optional<report::CalibrationReportInput::Truth> truth;
  std::vector<std::string> warnings;  ///< of the recordings
  std::uint64_t observations = 0;
  double read_s = 0, angles_s = 0, solve_s = 0, total_s = 0;
};

Json calibration_json(const CalibrationOutcome& outcome);
void print_calibration(const CalibrationOutcome& outcome);

Json forecast_json(const calibration::CalibrationForecast& forecast, const TrainShape& shape);
void print_forecast(const calibration::CalibrationForecast& forecast, const TrainShape& shape);

}  // namespace risley::app
