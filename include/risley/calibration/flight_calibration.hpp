// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/calibration_verdict.hpp"
#include "risley/calibration/datum.hpp"
#include "risley/calibration/flight_adjustment.hpp"
#include "risley/calibration/flight_judgement.hpp"
#include "risley/calibration/flight_shots.hpp"
#include "risley/calibration/ground_cells.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/estimation/weak_directions.hpp"
#include "risley/scenes/control.hpp"
#include "risley/sensors/sensor.hpp"
#include "risley/trajectories/error_process.hpp"
#include "risley/trajectories/mount.hpp"
#include "risley/trajectories/tangent_frame.hpp"
#include "risley/trajectories/trajectory.hpp"

namespace risley::calibration {

/// Start values, free parameters and use of the data of a calibration in flight.
struct FlightCalibrationOptions {
  /// Start values, noise, geometry. Its stated parameters are the priors; a sensor with a
  /// covariance, as a calibration on walls writes it, contributes all of it.
  sensors::Sensor sensor;
  trajectories::Mount mount;  ///< start values, and priors by their sigmas; a sigma of 0 holds
  /// Of the trajectory; if it states no sigma the trajectory's own accuracies apply.
  trajectories::ErrorModel errors = trajectories::assumed_error_model();
  std::vector<std::string> fixed;       ///< parameters of the train to hold
  std::vector<std::string> additional;  ///< further ones to free, e.g. refractive_index
  std::optional<double> range_noise;    ///< 1 sigma, m, default the sensor's
  double range_offset_sigma = 0.02;     ///< prior about the sensor's, m; 0 holds it
  /// Prior of the prisms' angles without a stated sigma, rad (0.3 degree).
  double angle_sigma = 5.2359877559829887e-3;
  /// Root mean square error of directions up to which a unit counts as sound, rad; default the
  /// sensor's specification. 0: every significant error is too large.
  std::optional<double> tolerance;
  double rotation_angle_sigma = 0;  ///< independent noise of every rotation angle, rad
  double knot_spacing = 0.25;       ///< of the corrections of the trajectory, s
  /// The spacing is enlarged if there would be more knots: the time grows with the third power.
  std::size_t most_knots = 600;
  /// Known ground, in the frame of the trajectory.
  std::vector<scenes::KnownGround> control;
  double cell_size = 2;               ///< of the ground's cells at the end, m
  double most_roughness = 0.06;       ///< of a cell, m, see GroundCellOptions
  std::size_t coarse_shots = 120000;  ///< used in the first rounds
  /// Used in the last but one: these show the ranges' noise.
  std::size_t many_shots = 2'000'000;
  std::uint64_t seed = 0;  ///< of their choice
};

/// A drift of the recording's clock that the adjustment does not model, as detected in the flight.
struct ClockDrift {
  double value = 0, sigma = 0;  ///< gain of the trajectory's clock on the recording's, s/s
  double seconds = 0;           ///< time between the first and the last shot
  /// Significant: the result assumes a clock that does not drift, but the clock does.
  bool significant = false;
};

/// Attitudes of the trajectory that lag behind its positions, as detected in the flight.
struct AttitudeDelay {
  double value = 0, sigma = 0;  ///< s; above 0: attitudes are late
  /// Significant: the result assumes attitudes without delay, but they are late.
  bool significant = false;
};

/// Jumps of the trajectory's errors beyond its stated errors.
struct TrajectoryJump {
  std::int64_t begin_ns = 0, end_ns = 0;  ///< between which, by the recording's clock
  std::size_t strip = 0;                  ///< from 0; for a jump between strips the strip before it
  bool between_strips = false;
  double score = 0;  ///< excess over the stated process, in sigmas
  /// Jumps of the trajectory against the truth, in the order of the corrections, m and rad; the
  /// heading clockwise.
  std::array<double, kCorrections> size{}, sigma{};
};

/// Fit of the trajectory's corrections to its stated errors.
struct TrajectoryFit {
  /// [6] in the order of the corrections: squared sigmas by which they move from knot to knot, and
  /// what was expected of them; both as stated, before anything was mended.
  std::array<double, kCorrections> chi2{}, expected{};
  /// Relative to the stated sigmas: 1 if they are correct.
  std::array<double, kCorrections> factor{1, 1, 1, 1, 1, 1};
  std::vector<TrajectoryJump> jumps;  ///< by time; each has a step of its own in the adjustment
  bool fits = true;                   ///< after that
};

/// A held parameter that may be wrong, and its value according to the flight.
struct HeldParameter {
  std::string name;
  double held = 0, stated_sigma = 0;  ///< SI
  double from_flight = 0, sigma = 0;  ///< by the flight alone, SI
  /// Significant: the result assumes the held value, which the flight contradicts.
  bool significant = false;
};

/// The flight's measurement of known ground.
struct SeenControl {
  std::string name;
  std::size_t shots = 0;  ///< within its circle
  bool used = false;      ///< there are enough of them, and they form a plane
  double off = 0;         ///< of the measured ground against the known one, along the normal, m
  double sigma = 0;       ///< as it was stated, m
  /// Significant: the known ground contradicts the rest.
  bool significant = false;
};

/// Result of one calibration in flight.
struct FlightCalibration : FlightJudgement {
  bool converged = false;
  std::string reason;  ///< why not; empty when converged
  CalibrationVerdict verdict;
  std::vector<Warning> warnings;
  trajectories::Mount mount;     ///< adjusted, with sigmas
  sensors::Sensor sensor;        ///< adjusted, with covariance
  PointingError pointing_error;  ///< of the given prisms against the adjusted ones
  double tolerance = 0;          ///< used for the verdict, rad; 0: none
  FlightModel model;             ///< with corrections at the knots and planes, in the tangent frame
  ClockDrift clock_drift;
  AttitudeDelay attitude_delay;
  /// Significant: the clock offset contradicts its stated value.
  bool clock_contradicts = false;
  TrajectoryFit trajectory_fit;
  std::vector<HeldParameter> held;   ///< mostly indices that recordings determined
  std::vector<SeenControl> control;  ///< in the order of the options
  std::vector<StripPair> pairs_before, pairs_after;
  double rms_before = 0, rms_after = 0;  ///< of all pairs and cells, along the normals, m
  double sigma0 = 1;       ///< standard deviation of unit weight against the stated range noise
  double range_sigma = 0;  ///< of one range, as found, m
  /// Part of it common to neighbouring shots because the ground is not plane, 1 sigma, m; 0 if
  /// chance explains it.
  double roughness = 0;
  std::size_t shots = 0;         ///< given
  std::size_t without_pose = 0;  ///< of these: outside the trajectory or in a gap of it
  std::size_t used = 0, outliers = 0;
  std::size_t cells = 0, rough_cells = 0;
  std::vector<double> piece_time, piece_rms;  ///< residuals along time: s since the first shot, m
  trajectories::TangentFrame tangent;
  trajectories::Trajectory trajectory;  ///< corrected, in the frame of the one given
};

/// Calibrates mount and sensor on the strips of a flight: docs/theory/flight.md
/// @param trajectory  of the body
/// @throws EstimationError when fewer than two strips overlap or no ground is found;
///         InvalidArgument as require_flight_shots, require_trajectory, require_mount,
///         require_known_ground, ErrorProcess, for rotation angles and emitters that the sensor
///         does not have and options out of range
FlightCalibration calibrate_flight(const FlightShots& shots,
                                   const trajectories::Trajectory& trajectory,
                                   const FlightCalibrationOptions& options,
                                   const Progress& progress = {});

}  // namespace risley::calibration
