// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "risley/calibration/plane_points.hpp"

namespace risley::calibration {

/// The believed parameters as all recordings together determine them: what the sensor computes its
/// directions with.
struct Belief {
  sensors::Sensor sensor;
  std::vector<estimation::FreeParameter> free;
  Eigen::MatrixXd covariance;                    ///< [free, free], SI units
  std::vector<std::vector<double>> angle_shift;  ///< [recordings][prisms], rad
  /// What the estimates held and what one sigma of it does to the belief and, that of the belief
  /// included, to the rotation angles.
  std::vector<estimation::FreeParameter> held;
  Eigen::MatrixXd held_changes;                     ///< [free, held], SI
  std::vector<Eigen::MatrixXd> held_angle_changes;  ///< [recordings] of [prisms, held], rad
};

/// Mean of the recordings' own estimates, weighted by their information, and how far it moves the
/// rotation angles of each.
/// @throws InvalidArgument for recordings of different sensors by serial number or rotors,
///         EstimationError when their parameters disagree
Belief pooled_belief(const std::vector<RangedRecording>& recordings);

}  // namespace risley::calibration
