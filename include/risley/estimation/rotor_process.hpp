// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/core/angle.hpp"

namespace risley::estimation {

/// Motion model of a rotor between two observations: the angle advances by the speed, the speed by
/// the acceleration, and each has white noise. [B21 Eq. (27)] The paper adds one noise term per
/// state and step. Here the noise is a continuous process, so that its effect does not depend on
/// the observation rate. The paper's states end at the speed; the white jerk allows a smooth swing,
/// as caused by a speed controller (Fig. 9).
struct RotorProcess {
  double acceleration = 0;  ///< white acceleration: random walk of the speed, (rad/s) / sqrt(s)
  double angle_walk = 0;    ///< random walk of the angle, rad / sqrt(s)
  double jerk = 0;          ///< white jerk: random walk of the acceleration, (rad/s^2) / sqrt(s)
};

/// The heavy noise that makes the filter reproduce the paper's section 3.2: residuals of 0.0085
/// degree where the noise is 0.01, and rotation angles of 0.025 degree. The paper does not state
/// its tuning; this one gives results in the middle of its reported range.
inline constexpr RotorProcess kPaperProcess{radians_from_degrees(900.0), 0.0, 0.0};

/// A rotor with the motion reported in the paper: speeds that swing by 2.2 deg/s within seconds
/// (Fig. 9).
inline constexpr RotorProcess kTypicalRotor{0.0, 0.0, radians_from_degrees(4.0)};

/// A rotor with unknown motion: noise far above that of real ones, so that a first pass follows any
/// motion.
inline constexpr RotorProcess kSettlingProcess{radians_from_degrees(30.0), 0.0, 0.0};

/// A rotor that moves along a single parabola: constant acceleration. The jerk only introduces an
/// acceleration.
inline constexpr RotorProcess kConstantAcceleration{0.0, 0.0, 1e-12};

/// Covariance added to (angle, speed, acceleration) by a step of dt seconds.
struct RotorStepCovariance {
  double angle_angle = 0, angle_speed = 0, angle_acceleration = 0;
  double speed_speed = 0, speed_acceleration = 0, acceleration_acceleration = 0;
};

/// The integrals of both white processes over the step: docs/theory/map.md
/// @param dt  s; its sign does not matter, noise grows both ways
constexpr RotorStepCovariance step_covariance(const RotorProcess& process, double dt) {
  const double step = dt < 0 ? -dt : dt;
  const double sign = dt < 0 ? -1.0 : 1.0;
  const double q = process.acceleration * process.acceleration;
  const double j = process.jerk * process.jerk;
  const double step2 = step * step, step3 = step2 * step;
  return {
      q * step3 / 3.0 + process.angle_walk * process.angle_walk * step + j * step3 * step2 / 20.0,
      sign * (q * step2 / 2.0 + j * step2 * step2 / 8.0),
      j * step3 / 6.0,
      q * step + j * step3 / 3.0,
      sign * j * step2 / 2.0,
      j * step};
}

}  // namespace risley::estimation
