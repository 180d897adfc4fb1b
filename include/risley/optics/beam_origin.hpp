// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "risley/optics/observation_adjoint.hpp"

/// Where the beam leaves the sensor. The prisms shift it sideways on its way through them, so it
/// does not start at the frame's origin.                                          [B21 App. A]
namespace risley {

/// Size and place of the prisms, the same for all of a train. All zero: thin prisms at one place,
/// every beam starts at the frame's origin.
struct PrismGeometry {
  double thickness = 0;  ///< of a prism on the axis, m
  double spacing = 0;    ///< between the perpendicular faces of neighbouring prisms, m
};

/// X of the points where the faces, in beam order, cross the axis, m [2 prisms]. The perpendicular
/// face of the last prism stands at 0, where the frame has its origin.
std::vector<double> face_positions(const std::vector<FaceOrder>& face_order,
                                   const PrismGeometry& geometry);

/// The point where the beam leaves the last face, m, sensor frame. The incident beam meets the
/// first face on the axis; every further point is where the beam meets the next face. A face is
/// taken to cross the axis at the same point whatever its tilt.                            [B21
/// App. A]
/// @param face_position  as face_positions() gives them
template <ModelScalar T, int N>
Vector3<T> beam_origin(const Trace<T, N>& trace, const std::array<T, 2 * N>& face_position) {
  Vector3<T> point{face_position[0], T(0.0), T(0.0)};
  for (std::size_t i = 1; i < 2 * N; ++i) {
    const Vector3<T> to_face{face_position[i] - point.x, -point.y, -point.z};
    const T length = dot(trace.normal[i], to_face) / trace.refraction[i].cosine_in;
    point += length * trace.incident[i];
  }
  return point;
}

/// A beam as a line in space.
struct Ray {
  Vector3<double> origin;     ///< where it leaves the last face, m, sensor frame
  Vector3<double> direction;  ///< unit vector, sensor frame
  bool valid = false;         ///< when false, all others are NaN
};

/// The ray of one shot.
/// @param rotation_angles  [prisms], rad, beam order
/// @throws InvalidArgument when their number is not that of the prisms
Ray emergent_ray(const PrismTrain& train, const PrismGeometry& geometry,
                 std::span<const double> rotation_angles);

}  // namespace risley
