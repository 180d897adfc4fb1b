// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/flight_calibration.hpp"

namespace risley::calibration {

/// Residuals beyond this many sigmas are rejected in the end.
inline constexpr double kGateSigmas = 3;
inline constexpr std::size_t kFewestCells = 20;

/// Start values of a calibration in flight, and its prior knowledge.
struct FlightStart {
  FlightModel model;  ///< without knots and planes
  FlightPriors priors;
  Eigen::VectorXd prior_sigma;  ///< [globals]
  std::size_t considered = 0;   ///< number of the last free parameters: held, and possibly off
};

/// @param local  the trajectory in a local frame
/// @throws InvalidArgument for options out of range, an invalid covariance of the sensor, and as
/// require_mount, ErrorProcess
FlightStart flight_start(const FlightCalibrationOptions& options,
                         const trajectories::Trajectory& local);

/// Which globals are held if all adjustable ones are adjusted.
std::vector<bool> held_globals(const FlightStart& start);

/// Variance of one range as stated in the options or the sensor, rounding included, m^2.
double stated_range_variance(const FlightCalibrationOptions& options);

/// Weights of shots whose ranges have that variance, without a gate.
FlightWeights flight_weights(const FlightCalibrationOptions& options, const FlightPriors& priors,
                             double range_variance);

/// Final spacing of knots: as requested, or larger if there would be too many.
/// @param knots  any of the same shots
double final_knot_spacing(const FlightCalibrationOptions& options, const TrajectoryKnots& knots,
                          std::size_t strips);

}  // namespace risley::calibration
