// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/calibration/calibration_plan.hpp"
#include "risley/jobs/calibrate_recordings.hpp"

namespace risley::app {

void print_calibration(const jobs::CalibratedRecordings& outcome);
void print_forecast(const calibration::CalibrationForecast& forecast, TrainShape shape);

}  // namespace risley::app
