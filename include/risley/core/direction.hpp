// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "risley/core/vector3.hpp"

namespace risley {

/// A direction as reported by the sensor: azimuth from X towards Y, zenith from Z, both rad.
template <class T>
struct SphericalAngles {
  T azimuth{}, zenith{};
};

/// Unit vector [3] of an azimuth and a zenith angle, rad.                       [B21 Eq. (31)]
template <class T>
Vector3<T> direction_from_angles(const SphericalAngles<T>& angles) {
  using std::cos;
  using std::sin;
  const T sin_zenith = sin(angles.zenith);
  return {sin_zenith * cos(angles.azimuth), sin_zenith * sin(angles.azimuth), cos(angles.zenith)};
}

/// Azimuth in [-pi, pi] and zenith in [0, pi] of a direction of any length > 0. [B21 Eq. (11-12)]
/// Both come from atan2: the paper's arctan loses the quadrant, and arccos loses half the digits
/// near the poles. On the Z axis itself the azimuth is 0 and has no derivative.
template <class T>
SphericalAngles<T> angles_from_direction(const Vector3<T>& direction) {
  using std::atan2;
  using std::sqrt;
  const T horizontal = sqrt(direction.x * direction.x + direction.y * direction.y);
  return {atan2(direction.y, direction.x), atan2(horizontal, direction.z)};
}

/// A scalar's way to compute the angles of a unit vector; batches specialise it.
template <class T>
struct UnitVectorAngles {
  /// As angles_from_direction().
  static SphericalAngles<T> of(const Vector3<T>& direction) {
    return angles_from_direction(direction);
  }
};

/// As angles_from_direction(), for a vector of length 1 (or NaN), which is faster for batches.
template <class T>
SphericalAngles<T> angles_from_unit_vector(const Vector3<T>& direction) {
  return UnitVectorAngles<T>::of(direction);
}

/// Angle between two unit vectors, rad, exact also for nearly parallel ones.
inline double angle_between(const Vector3<double>& a, const Vector3<double>& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b));
}

}  // namespace risley
