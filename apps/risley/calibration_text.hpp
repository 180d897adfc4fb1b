// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "risley/calibration/calibration_plan.hpp"
#include "risley/calibration/datum.hpp"
#include "risley/jobs/calibrate_recordings.hpp"
#include "risley/jobs/plan_calibration.hpp"

#include "command.hpp"

namespace risley::app {

/// @param total_time  that the verb took, s
Json calibration_json(const jobs::CalibratedRecordings& outcome, double total_time);
void print_calibration(const jobs::CalibratedRecordings& outcome);

/// How far directions are off, in the keys of the contract.
Json pointing_json(const calibration::PointingError& pointing);
/// Errors of directions against a known truth.
Json errors_json(const calibration::DirectionErrors& errors);
/// Slips of all recordings, each with the name of its own.
Json slips_of_all(const std::vector<jobs::ReadRecording>& recordings);

/// What a plan says where a calibration says whose sensor it was, and how it turned out.
Json plan_head(const std::string& sensor);
Json forecast_json(const jobs::PlannedCalibration& planned);
void print_forecast(const calibration::CalibrationForecast& forecast, TrainShape shape);

}  // namespace risley::app
