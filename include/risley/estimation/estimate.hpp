// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/estimation/coordinate_rounding.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/solution.hpp"
#include "risley/estimation/verdict.hpp"
#include "risley/estimation/weak_directions.hpp"

namespace risley::estimation {

/// How an estimate is made.
enum class Method {
  map,  ///< all shots at once: run_batch_map
  ekf,  ///< the paper's filter: run_ekf
};
/// "map" or "ekf"
const char* to_string(Method method);

/// What the user asks for.
struct EstimateOptions {
  sensors::Sensor sensor;  ///< start values; its combination is determined from the data
  /// 1 sigma of both angles before rounding, held, rad; empty: the batch estimator finds it, the
  /// filter uses the sensor's
  std::optional<double> angle_noise;
  std::vector<std::string> fixed;       ///< default free parameters to hold at the sensor's value
  std::vector<std::string> additional;  ///< further parameters to free
  std::vector<RotorProcess> rotor_process;  ///< empty: maximum likelihood
  std::optional<bool> mirrored;             ///< the elevation's sign is turned; empty: find out
  /// Directions come from coordinates in whole steps, such as millimetres, and the series has
  /// ranges: determines whether these were rounded or truncated.
  bool cartesian = false;
  /// The recording's frame is turned against the sensor's; empty: it is where shots lie outside the
  /// sensor's field of view.
  std::optional<bool> turned;
};

/// The free parameters of a user's choice: the default ones less the fixed ones plus the others.
/// @throws InvalidArgument for unknown names
std::vector<FreeParameter> chosen_parameters(const EstimateOptions& options);

/// One estimated quantity, SI units.
struct EstimatedValue {
  std::string name;
  double value = 0;
  double sigma = 0;             ///< including possible errors of held parameters
  double sigma_given_held = 0;  ///< if they were exact
};

/// Change of an estimate when held parameters are off by x sigma each: x times the first order plus
/// x^2 times the second.
struct HeldChanges {
  std::vector<FreeParameter> held;  ///< with the sensor's stated sigma as prior_sigma
  Eigen::MatrixXd values;           ///< first order [values, held], ordered as Estimate::values
  Eigen::MatrixXd curves;  ///< second order [values, held]; zero unless a reflection makes it large
  /// First order of the rotation angles, mean over the recording [prisms, held].
  Eigen::MatrixXd mean_angles;

  /// Contribution of one held parameter with a normally distributed x to the covariance of the
  /// first values [rows, rows].
  Eigen::MatrixXd covariance(std::size_t one, Eigen::Index rows) const;
};

/// All rotors turn faster or slower than the sensor's by one factor, as with a wrong recording
/// clock, and rarely otherwise.
struct SpeedFactor {
  double value = 1;  ///< speed found over the sensor's
  double sigma = 0;
};

/// Complete result of one estimation: the solution, its inputs, and whether to trust it.
struct Estimate : Solution {
  Method method = Method::map;  ///< for reports only: all methods give the same kind of result
  bool converged = false;
  std::string reason;  ///< reason for not having converged; empty when converged
  EstimateVerdict verdict;
  std::vector<Warning> warnings;  ///< remarks for the user
  sensors::Sensor sensor;         ///< the calibrated sensor with its covariance
  bool mirrored = false;
  /// Complete rotation of the recording's frame, if it is not the sensor's; the series is turned
  /// back.
  std::optional<FrameEstimate> frame_turn;
  CoordinateRounding coordinates = CoordinateRounding::unknown;
  Start start;
  std::vector<FreeParameter> free;
  std::optional<SpeedFactor> speed_factor;  ///< if the rotors show a factor other than 1
  std::vector<EstimatedValue> values;       ///< parameters, mean speeds, first rotation angles
  HeldChanges held_changes;
  /// Parameter combinations that the data do not determine; with any, the estimate counts as not
  /// converged.
  std::vector<WeakDirection> unobservable;

  PackedSeries series;  ///< the shots in the sensor's frame, see prepare_shots()
  RotorStates states;   ///< at one shot per knot of the trajectory

  Moments azimuth_moments, zenith_moments;         ///< of all residuals, rad, without outliers
  std::vector<AngleProfile> residuals_over_angle;  ///< [prisms], of all shots
  bool noise_held = false;
  double expected_residual = 0;  ///< rms of noise and rounding together, rad
  /// The same with the noise stated in the sensor's preset, as expected for a healthy unit, rad.
  double usual_residual = 0;
  double usual_noise = 0;  ///< that noise, rad
};

/// Row of the first used shot, to which the estimate's rotation angles refer.
std::size_t first_used_shot(const Estimate& estimate);

/// Rotor states of shots [begin, end) of an estimate's series.
RotorStates states_of_shots(const Estimate& estimate, ShotRange shots);

/// Residuals of all shots of an estimate's series.
ShotResiduals residuals_of_shots(const Estimate& estimate);

/// Estimates parameters and rotation angles. A mirrored recording is turned first; results describe
/// the turned one. The filter works on a single stretch of time and uses the longest if the clock
/// was reset or the recording paused; the batch estimator uses all.
/// @param series  shots to use, as recorded
/// @param head    all shots of the first second, as recorded, for the start
/// @param found   about the head before
/// @throws EstimationError when the data give no result, InvalidArgument for unknown parameters
Estimate estimate(Method method, PackedSeries series, const AngleSeries& head,
                  const EstimateOptions& options, const Progress& progress = {},
                  StartFindings found = {});

}  // namespace risley::estimation
