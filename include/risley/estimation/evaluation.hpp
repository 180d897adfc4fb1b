// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/estimation/estimate.hpp"
#include "risley/recordings/truth.hpp"

namespace risley::estimation {

/// Error of one quantity against the truth, SI units.
struct TruthComparison {
  std::string name;
  double truth = 0;
  double error = 0;
  double error_over_sigma = 0;
};

/// Comparison of an estimate with a simulation's truth.
struct Evaluation {
  std::vector<TruthComparison> parameters;
  std::vector<std::vector<double>> rotation_angle_error;  ///< [prisms][shots], rad
  std::vector<double> rotation_angle_rmse;                ///< [prisms], rad
  std::vector<double> angular_velocity_rmse;              ///< [prisms], rad/s
  /// Root mean square errors over the root mean square of the stated sigmas [prisms].
  std::vector<double> rotation_angle_rmse_over_sigma, angular_velocity_rmse_over_sigma;
  /// Per degree of freedom; 1 if the sigmas are correct. Held parameters are included if they are
  /// off in the truth.
  double nees_parameters = 0;
  double nees_rotation_angles = 0;  ///< per degree of freedom, mean over shots
};

/// @param truth_sensor  the simulated sensor
/// @param truth         its rotation angles at every shot
/// @throws InvalidArgument when a shot of the estimate is not in the truth, for a true sensor of
///         another shape and for columns of other lengths
Evaluation evaluate(const Estimate& estimate, const sensors::Sensor& truth_sensor,
                    const recordings::TruthColumns& truth);

}  // namespace risley::estimation
