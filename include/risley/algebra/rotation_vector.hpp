// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

/// Rotation vectors: the axis of a rotation times its angle, rad.
namespace risley::algebra {

/// The rotation vector, of length [0, pi], of a unit quaternion of either sign.
inline Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1 : 1;
  const double sine = q.vec().norm();
  // angle / sine of half of it; 2 to full precision for small angles
  const double factor = sine < 1e-9 ? 2 : 2 * std::atan2(sine, sign * q.w()) / sine;
  return sign * factor * q.vec();
}

/// The rotation vector, of length [0, pi], of a rotation matrix.
inline Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

/// The rotation of a rotation vector.
inline Eigen::AngleAxisd rotation_by(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (angle == 0) return {0, Eigen::Vector3d::UnitX()};
  return {angle, vector / angle};
}

/// Below this angle, rad, series replace sine and cosine: they are exact to the last digit there,
/// and cover the record interval of any navigation system.
inline constexpr double kSmallTurn = 0.02;

/// The same as a quaternion, fast for small angles.
inline Eigen::Quaterniond turned_by(const Eigen::Vector3d& vector) {
  const double squared = vector.squaredNorm();
  double cosine = 0, factor = 0;  // of half the angle; its sine over the angle
  if (squared < kSmallTurn * kSmallTurn) {
    cosine = 1 - squared * (1.0 / 8 - squared * (1.0 / 384 - squared / 46080));
    factor = 0.5 - squared * (1.0 / 48 - squared * (1.0 / 3840 - squared / 645120));
  } else {
    const double angle = std::sqrt(squared);
    cosine = std::cos(0.5 * angle);
    factor = std::sin(0.5 * angle) / angle;
  }
  return {cosine, factor * vector.x(), factor * vector.y(), factor * vector.z()};
}

/// Angular velocity, in the rotated axes, of a rotation vector that changes at a given rate.
inline Eigen::Vector3d angular_velocity_of(const Eigen::Vector3d& vector,
                                           const Eigen::Vector3d& rate) {
  const double squared = vector.squaredNorm();
  double first = 0, second = 0;  // (1 - cos a) / a^2 and (a - sin a) / a^3
  if (squared < kSmallTurn * kSmallTurn) {
    first = 0.5 - squared * (1.0 / 24 - squared * (1.0 / 720 - squared / 40320));
    second = 1.0 / 6 - squared * (1.0 / 120 - squared * (1.0 / 5040 - squared / 362880));
  } else {
    const double angle = std::sqrt(squared);
    first = (1 - std::cos(angle)) / squared;
    second = (angle - std::sin(angle)) / (squared * angle);
  }
  const Eigen::Vector3d across = vector.cross(rate);
  return rate - first * across + second * vector.cross(across);
}

/// The matrix of the cross product: times w it gives v x w.
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return m;
}

}  // namespace risley::algebra
