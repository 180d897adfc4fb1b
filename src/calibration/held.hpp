// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/datum.hpp"
#include "risley/calibration/planar_adjustment.hpp"
#include "risley/sensors/sensor.hpp"

#include "calibration/belief.hpp"

namespace risley::calibration {

/// A parameter that a calibration did not estimate and that may be off, by how much for a sigma of
/// each held quantity that moves the optics [held], SI.
struct MovedParameter {
  std::string name;
  Eigen::RowVectorXd by_held;
};

/// What a calibration held and what may be off: by one sigma each.
struct Held {
  std::vector<std::string> names;  ///< [held]
  HeldQuantities quantities;
  /// Whether a quantity moves the optics themselves. The sensor's own tilts do not: whoever uses
  /// the calibration computes rotation angles with the same errors again, which cancel what these
  /// did.
  std::vector<bool> moves_optics;  ///< [held]
  std::vector<MovedParameter> moved;
};

/// The sensor's own computations hold what the estimates of the directions held, wedges before all:
/// that moves rotation angles and the indices found with them. The true prisms have those indices
/// and wedges, and tilts of their own that no wall determines. docs/theory/calibration.md
/// @param sensor  the preset, with what is known of its parameters
Held held_of(const sensors::Sensor& sensor, const Belief& belief, const PlanarProblem& problem);

/// What the held quantities do to the beams once the adjustment has answered.
/// @param changes  of the free parameters [free, held]
HeldMovement movement_of(const Held& held, const PlanarProblem& problem,
                         const Eigen::MatrixXd& changes);

}  // namespace risley::calibration
