// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/core/angle.hpp"

namespace risley::estimation {

/// How a rotor is allowed to move between two observations: the angle advances by the speed, and
/// both take white noise.                                                       [B21 Eq. (27)]
/// The paper adds one noise term per state and step. Here the noise is a continuous process, so
/// that its effect does not depend on the observation rate: white acceleration (a random walk of
/// the speed) and, optionally, a random walk of the angle itself.
struct RotorProcess {
  double acceleration = 0;  ///< random walk of the speed, (rad/s) / sqrt(s)
  double angle_walk = 0;    ///< random walk of the angle, rad / sqrt(s)
};

/// The heavy noise that makes the filter reproduce the paper's section 3.2: residuals of 0.0085
/// degree where the noise is 0.01, and rotation angles of 0.025 degree. The paper does not print
/// its tuning; this one lands in the middle of what it reports.
inline constexpr RotorProcess kPaperProcess{radians_from_degrees(900.0), 0.0};

/// Covariance that a step of dt seconds adds to (angle, speed).
struct RotorStepCovariance {
  double angle_angle = 0, angle_speed = 0, speed_speed = 0;
};

/// @param dt  s; its sign does not matter, noise grows both ways
constexpr RotorStepCovariance step_covariance(const RotorProcess& process, double dt) {
  const double step = dt < 0 ? -dt : dt;
  const double q = process.acceleration * process.acceleration;
  return {q * step * step * step / 3.0 + process.angle_walk * process.angle_walk * step,
          q * step * dt / 2.0, q * step};
}

}  // namespace risley::estimation
