// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "risley/calibration/plane_points.hpp"

namespace risley::calibration {

/// The believed parameters as determined by all recordings together: those with which the sensor
/// computes its directions.
struct Belief {
  sensors::Sensor sensor;
  std::vector<estimation::FreeParameter> free;
  Eigen::MatrixXd covariance;                    ///< [free, free], SI units
  std::vector<std::vector<double>> angle_shift;  ///< [recordings][prisms], rad
  /// Held values of the estimates and the effect of one sigma of each on the belief and, including
  /// the belief's own, on the rotation angles.
  std::vector<estimation::FreeParameter> held;
  Eigen::MatrixXd held_changes;                     ///< [free, held], SI
  std::vector<Eigen::MatrixXd> held_angle_changes;  ///< [recordings] of [prisms, held], rad
};

/// Mean of the recordings' own estimates, weighted by their information, and the resulting shift of
/// the rotation angles of each.
/// @throws InvalidArgument for recordings of different sensors by serial number or rotors,
///         EstimationError when their parameters disagree
Belief pooled_belief(const std::vector<RangedRecording>& recordings);

}  // namespace risley::calibration
