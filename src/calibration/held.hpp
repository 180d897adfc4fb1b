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

/// A parameter that a calibration did not estimate and that may be off, with its change for a sigma
/// of each held quantity that affects the optics [held], SI.
struct MovedParameter {
  std::string name;
  Eigen::RowVectorXd by_held;
};

/// Held quantities of a calibration that may be off, by one sigma each.
struct Held {
  std::vector<std::string> names;  ///< [held]
  HeldQuantities quantities;
  /// Whether a quantity affects the optics themselves. The sensor's own tilts do not: any use of
  /// the calibration computes rotation angles with the same errors again, which cancel.
  std::vector<bool> moves_optics;  ///< [held]
  std::vector<MovedParameter> moved;
};

/// The sensor's own computations use the held values of the directions' estimates, mainly the
/// wedges: that moves rotation angles and the indices found with them. The true prisms have those
/// indices and wedges, and their own tilts, which no wall determines. docs/theory/calibration.md
/// @param sensor  the preset, with its parameters' uncertainties
Held held_of(const sensors::Sensor& sensor, const Belief& belief, const PlanarProblem& problem);

/// Effect of the held quantities on the beams after the adjustment.
/// @param changes  of the free parameters [free, held]
HeldMovement movement_of(const Held& held, const PlanarProblem& problem,
                         const Eigen::MatrixXd& changes);

}  // namespace risley::calibration
