// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <limits>

#include "risley/core/direction.hpp"
#include "risley/core/vector3.hpp"

namespace risley {

/// All points p with dot(normal, p) = distance.
struct Plane {
  Vector3<double> normal{1.0, 0.0, 0.0};  ///< unit vector, pointing away from the origin
  double distance = 0;                    ///< of the plane from the origin, m, >= 0
};

/// The plane at a distance, m, whose normal has this azimuth and zenith, rad.
inline Plane plane_from_angles(const SphericalAngles<double>& normal, double distance) {
  return {direction_from_angles(normal), distance};
}

/// Distance of a point from the plane, m: positive beyond it, negative on the origin's side.
inline double signed_distance(const Plane& plane, const Vector3<double>& point) {
  return dot(plane.normal, point) - plane.distance;
}

/// Distance along a ray to the plane, m: negative behind the ray's start, NaN when the ray is
/// parallel to the plane.
/// @param origin     start of the ray, m
/// @param direction  unit vector
inline double hit_distance(const Plane& plane, const Vector3<double>& origin,
                           const Vector3<double>& direction) {
  const double approach = dot(plane.normal, direction);
  if (approach == 0.0) return std::numeric_limits<double>::quiet_NaN();
  return -signed_distance(plane, origin) / approach;
}

}  // namespace risley
