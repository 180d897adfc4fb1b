// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "risley/calibration/calibration_plan.hpp"
#include "risley/core/progress.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/scenes/scene.hpp"

namespace risley::jobs {

/// The calibration to plan. SI units.
struct PlanCalibrationOptions {
  scenes::Scene scene;  ///< walls, and the stations to scan them from
  GivenSensor sensor;   ///< as load_result(); empty: kUsualSensor
  HeldParameters fixed;
  std::vector<std::string> additional;  ///< further parameters to free
  /// As calibration::CalibrationPlan has them.
  double duration = calibration::CalibrationPlan{}.duration;
  std::optional<double> rate, range_noise, prior_sigma;
  bool flat_walls = false;  ///< exact planes, and no range errors except a constant one
  double range_offset_sigma = calibration::CalibrationPlan{}.range_offset_sigma;
  bool beam_origin = true;
};

/// What it would reach.
struct PlannedCalibration {
  std::string sensor;  ///< name of its preset
  TrainShape shape;
  calibration::CalibrationForecast forecast;
};

/// @throws EstimationError when no shot meets a wall; InvalidArgument; FileError; Cancelled
PlannedCalibration plan_calibration(const PlanCalibrationOptions& options,
                                    const Progress& progress = {});

}  // namespace risley::jobs
