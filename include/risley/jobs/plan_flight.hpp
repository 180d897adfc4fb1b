// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/calibration/flight_forecast.hpp"
#include "risley/cloud/point_distribution.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/scenes/terrain.hpp"
#include "risley/trajectories/error_process.hpp"
#include "risley/trajectories/flight_plan.hpp"
#include "risley/trajectories/mount.hpp"

namespace risley::jobs {

/// The flight to plan. SI units.
struct PlanFlightOptions {
  trajectories::FlightPlan plan;
  trajectories::Mount mount;                    ///< its sigmas are the prior knowledge
  trajectories::ErrorModel errors;              ///< of the resulting trajectory; states all sigmas
  std::optional<scenes::TerrainParts> terrain;  ///< empty: level ground at a height of 0
  GivenSensor sensor;                           ///< as load_result(); empty: kUsualSensor
  HeldParameters fixed;
  std::vector<std::string> additional;  ///< further parameters to free
  /// As in calibration::FlightForecastOptions and calibration::FlightCalibrationOptions.
  std::optional<double> rate, range_noise, prior_sigma;
  double range_offset_sigma = calibration::FlightCalibrationOptions{}.range_offset_sigma;
  double knot_spacing = calibration::FlightCalibrationOptions{}.knot_spacing;
  double cell_size = calibration::FlightCalibrationOptions{}.cell_size;
  std::uint64_t seed = 0;
  cloud::PointDistributionOptions distribution;
};

/// Inputs of a plan; texts are paths.
struct FlightPlanFiles {
  std::string plan;
  GivenMount mount;
  std::string errors;  ///< none of those above may be empty
  std::string scene;   ///< with a terrain; empty: level ground
};

/// Whether a file is a flight plan, and not a scene of walls. @throws FileError
bool is_flight_plan(const std::string& path);

/// Loads the files into the options.
/// @throws InvalidArgument for a missing file and for a scene without terrain; FileError
void load_flight_plan(const FlightPlanFiles& files, PlanFlightOptions& options);

/// Forecast of a flight.
struct PlannedFlightResult {
  sensors::Sensor sensor;
  calibration::FlightForecast forecast;
  /// Of all shots that the sensor fires; empty if the sensor does not look down.
  std::optional<cloud::PointDistributionSummary> distribution;
  std::vector<Warning> warnings;
};

/// Accuracy of a calibration on the strips of a planned flight, and the distribution of its points
/// on the ground. Stages: calibration, points.
/// @throws EstimationError when fewer than two strips overlap or no ground is found;
///         InvalidArgument; FileError; Cancelled
PlannedFlightResult plan_flight(const PlanFlightOptions& options, const Progress& progress = {});

}  // namespace risley::jobs
