// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/calibration/calibration_plan.hpp"
#include "risley/jobs/calibrate_recordings.hpp"

#include "command.hpp"

namespace risley::app {

/// @param total_time  that the verb took, s
Json calibration_json(const jobs::CalibratedRecordings& outcome, double total_time);
void print_calibration(const jobs::CalibratedRecordings& outcome);

Json forecast_json(const calibration::CalibrationForecast& forecast, TrainShape shape);
void print_forecast(const calibration::CalibrationForecast& forecast, TrainShape shape);

}  // namespace risley::app
