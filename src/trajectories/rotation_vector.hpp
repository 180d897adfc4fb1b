// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

/// Rotation vectors: the axis of a rotation times its angle, rad.
namespace risley::trajectories {

/// The rotation vector, of length [0, pi], of a unit quaternion of either sign.
inline Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1 : 1;
  const double sine = q.vec().norm();
  // angle / sine of half of it; 2 to all digits for small ones
  const double factor = sine < 1e-9 ? 2 : 2 * std::atan2(sine, sign * q.w()) / sine;
  return sign * factor * q.vec();
}

/// The quaternion of a rotation vector.
inline Eigen::Quaterniond turned_by(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  const double factor = angle < 1e-9 ? 0.5 : std::sin(0.5 * angle) / angle;
  Eigen::Quaterniond q;
  q.w() = std::cos(0.5 * angle);
  q.vec() = factor * vector;
  return q;
}

/// Angular velocity, in the axes that are turned, where a rotation vector changes at a rate.
inline Eigen::Vector3d angular_velocity_of(const Eigen::Vector3d& vector,
                                           const Eigen::Vector3d& rate) {
  const double squared = vector.squaredNorm(), angle = std::sqrt(squared);
  const bool small = angle < 1e-3;  // the series are then exact to 1e-14
  const double first = small ? 0.5 - squared / 24 : (1 - std::cos(angle)) / squared;
  const double second =
      small ? 1.0 / 6 - squared / 120 : (angle - std::sin(angle)) / squared / angle;
  const Eigen::Vector3d across = vector.cross(rate);
  return rate - first * across + second * vector.cross(across);
}

}  // namespace risley::trajectories
