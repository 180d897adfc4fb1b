// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/datum.hpp"
#include "risley/calibration/wall_shape.hpp"
#include "risley/core/progress.hpp"
#include "risley/estimation/weak_directions.hpp"
#include "risley/scenes/scene.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::calibration {

/// A planned calibration.
struct CalibrationPlan {
  sensors::Sensor sensor;
  /// Walls, and the stations to scan them from; without stations one scan from the origin. Normals
  /// with a sigma_deg are known, and so are rotations of stations when stations_known.
  scenes::Scene scene;
  bool stations_known = true;
  double duration = 10.0;             ///< of every recording, s
  std::optional<double> rate;         ///< shots per second, default the sensor's
  std::optional<double> range_noise;  ///< 1 sigma, m, default the sensor's
  std::optional<double> prior_sigma;  ///< of every free angle, rad
  double range_offset_sigma = 0.05;   ///< m
  bool beam_origin = true;
  /// Without parameters walls are exact planes, and ranges have a constant error alone.
  ShapePrior shape = typical_walls();
  std::vector<std::string> fixed, additional;  ///< parameters
};

/// What one wall gives.
struct PlannedWall {
  std::string name, station;
  double share = 0;           ///< of the station's shots
  double mean_incidence = 0;  ///< rad
  double mean_range = 0;      ///< m
};

/// What it will reach.
struct CalibrationForecast {
  std::vector<estimation::FreeParameter> free;
  Eigen::MatrixXd covariance;     ///< [free, free], SI
  double range_offset_sigma = 0;  ///< m
  DatumKind datum_kind = DatumKind::none;
  FormalDatum datum;
  /// For a plan with one pose before walls that have shape: if half of the time went to a second
  /// pose before the same walls, rolled by 180 degrees on the spot by an unknown angle.
  std::optional<FormalDatum> rolled;
  std::vector<estimation::WeakDirection> unobservable;
  std::vector<PlannedWall> walls;
  double shots = 0;                 ///< with a return, of all recordings
  std::vector<std::string> advice;  ///< possible improvements, in words
};

/// Cramer-Rao bound of the calibration: the normal equations of the default method at the sensor's
/// parameters for shots that meet the scene, with walls of the plan's shape, whatever the scene's
/// walls are. Wrong indices come on top. A sample represents all shots.
/// @throws EstimationError when no shot meets a wall; Cancelled; InvalidArgument for a duration,
///         rate, noise or sigma out of its range, and as calibration_parameters()
CalibrationForecast forecast(const CalibrationPlan& plan, const Progress& progress = {});

/// The unknowns of an adjustment, and their priors.
struct AdjustedParameters {
  std::vector<estimation::FreeParameter> free;
  std::vector<double> prior_sigma;  ///< [free], SI; infinite: nothing
};

/// The free parameters of a calibration and, with the sensor's sigmas as priors, the tilts that
/// walls determine and directions do not: prism A's horizontal one, by default; also the lean of a
/// last axis that has one.
/// @param angle_sigma  prior sigma of every angle, rad; none: only for these tilts
/// @throws InvalidArgument as calibration_parameters()
AdjustedParameters adjusted_parameters(const sensors::Sensor& sensor,
                                       const std::vector<std::string>& fixed,
                                       const std::vector<std::string>& additional,
                                       std::optional<double> angle_sigma);

/// Free parameters of a calibration: those that walls can determine, less the fixed ones plus the
/// others. The refractive index is held unless requested, since the recording itself determines it
/// better; so is a lean of the last axis, which is known no better than the walls' poses.
/// @throws InvalidArgument for a name that is no parameter of the prisms, or is in both lists
std::vector<estimation::FreeParameter> calibration_parameters(
    TrainShape shape, const std::vector<std::string>& fixed,
    const std::vector<std::string>& additional);

}  // namespace risley::calibration
