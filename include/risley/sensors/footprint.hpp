// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "risley/core/vector3.hpp"

namespace risley::sensors {

/// Axes of the horizontal and the vertical divergence of a beam. Unit vectors, perpendicular to the
/// beam and to each other, in the frame of the beam's direction.
struct FootprintAxes {
  Vector3<double> horizontal;  ///< perpendicular to the sensor's Z, to the left
  Vector3<double> vertical;    ///< upwards for a beam along X
};

/// Prisms deflect a beam and hardly rotate it about itself, so that its footprint keeps the
/// emitter's orientation. A beam along Z has its horizontal axis along Y.
/// @param direction  unit vector, sensor frame
inline FootprintAxes footprint_axes(const Vector3<double>& direction) {
  const double level = std::hypot(direction.x, direction.y);
  const Vector3<double> horizontal =
      level > 0.0 ? Vector3<double>{-direction.y / level, direction.x / level, 0.0}
                  : Vector3<double>{0.0, 1.0, 0.0};
  return {horizontal, cross(direction, horizontal)};
}

/// footprint_depth() takes this tangent along one axis of the footprint.
/// @param normal     of the surface, unit vector
/// @param direction  of the beam, unit vector
/// @param axis       of the footprint, unit vector
inline double footprint_slope(const Vector3<double>& normal, const Vector3<double>& direction,
                              const Vector3<double>& axis) {
  return dot(normal, axis) / dot(normal, direction);
}

}  // namespace risley::sensors
