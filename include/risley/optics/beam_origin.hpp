// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "risley/optics/observation_adjoint.hpp"

/// @file
/// The point where the beam leaves the sensor. The prisms shift it sideways on its way, so it does
/// not start at the frame's origin. [B21 App. A]
namespace risley {

/// Size and place of the prisms, in beam order: no value for 0, or one for all of a train, or one
/// each. All zero: thin prisms at one place, every beam starts at the frame's origin.
struct PrismGeometry {
  std::vector<double> thickness;  ///< of a prism on the axis, m [prisms]
  /// Between the perpendicular faces of a prism and of the next, m [prisms - 1].
  std::vector<double> spacing;

  friend bool operator==(const PrismGeometry&, const PrismGeometry&) = default;
};

/// One number of a PrismGeometry by its name.
struct PrismSize {
  std::string name;    ///< with its unit, e.g. "prism_thickness_m"
  PrismGeometry rate;  ///< d geometry / d number: ones and zeros
};

/// The sizes common to all prisms, prism_thickness_m and prism_spacing_m.
std::vector<PrismSize> shared_prism_sizes();
/// The prisms' own: prism_thickness_a_m ..., then prism_spacing_a_m (from prism A to B) ...
/// @throws InvalidArgument for a number of prisms that no train has
std::vector<PrismSize> own_prism_sizes(int prisms);

/// X of the points where the faces, in beam order, cross the axis, m [2 prisms]. The perpendicular
/// face of the last prism is at 0, the frame's origin. Zeros if an element reflects, whatever the
/// geometry: see beam_path().
/// @throws InvalidArgument for a number of prisms that no train has, and for a geometry of another
///         number of prisms or with sizes that are not finite
std::vector<double> face_positions(const std::vector<FaceOrder>& face_order,
                                   const PrismGeometry& geometry);

/// Points where the beam crosses every face.
template <ModelScalar T, TrainLayout N>
struct BeamPath {
  std::array<Vector3<T>, 2 * N> point;  ///< m, sensor frame
  std::array<T, 2 * N> length;          ///< from the face before, m; that of the first face is 0
  std::array<T, 2 * N> over_cosine;     ///< 1 / cosine of the angle of incidence, from face 1

  /// The point where the beam leaves the last face, m, sensor frame.
  const Vector3<T>& origin() const { return point[2 * N - 1]; }
};

/// The incident beam meets the first face on the axis; every further point is where the beam meets
/// the next face. Assumes that a face crosses the axis at the same point at any tilt. [B21 App. A]
/// Where an element reflects, all faces meet the beam at the frame's origin: a unit was found to
/// have one centre within 0.13 mm.
/// @param face_position  as returned by face_positions()
template <ModelScalar T, TrainLayout N>
BeamPath<T, N> beam_path(const Trace<T, N>& trace, const std::array<T, 2 * N>& face_position) {
  BeamPath<T, N> path;
  if constexpr (N.reflects()) {
    path.point.fill({T(0.0), T(0.0), T(0.0)});
    path.length.fill(T(0.0));
    path.over_cosine.fill(T(0.0));
    return path;
  }
  path.point[0] = {face_position[0], T(0.0), T(0.0)};
  path.length[0] = T(0.0);
#pragma GCC unroll 8
  for (std::size_t i = 1; i < 2 * kElements<N>; ++i) {
    const Vector3<T>& before = path.point[i - 1];
    const Vector3<T> to_face{face_position[i] - before.x, -before.y, -before.z};
    path.over_cosine[i] = T(1.0) / trace.cosine_in[i];
    path.length[i] = dot(trace.normal[i], to_face) * path.over_cosine[i];
    path.point[i] = before + path.length[i] * trace.incident(i);
  }
  return path;
}

/// The point where the beam leaves the last face, m, sensor frame: see beam_path().
template <ModelScalar T, TrainLayout N>
Vector3<T> beam_origin(const Trace<T, N>& trace, const std::array<T, 2 * N>& face_position) {
  return beam_path(trace, face_position).origin();
}

/// Contribution of the beam's origin to the derivatives at the faces.
template <ModelScalar T, TrainLayout N>
struct BeamPathAdjoint {
  std::array<Vector3<T>, 2 * N> incident, normal;  ///< d result / d beam and normal of each face
  std::array<T, 2 * N> face_position;              ///< d result / d position of each face
};

/// Reverse pass of beam_path().                            Derivation: docs/theory/derivatives.md
/// @param origin_bar  d result / d origin
template <ModelScalar T, TrainLayout N>
BeamPathAdjoint<T, N> beam_path_adjoint(const Trace<T, N>& trace, const BeamPath<T, N>& path,
                                        const std::array<T, 2 * N>& face_position,
                                        Vector3<T> origin_bar) {
  BeamPathAdjoint<T, N> out;
  const Vector3<T> zero{T(0.0), T(0.0), T(0.0)};
  out.incident[0] = out.normal[0] = zero;
  if constexpr (N.reflects()) {
    out.incident.fill(zero);
    out.normal.fill(zero);
    out.face_position.fill(T(0.0));
    return out;
  }
#pragma GCC unroll 8
  for (std::size_t i = 2 * kElements<N> - 1; i > 0; --i) {
    const Vector3<T>& before = path.point[i - 1];
    const Vector3<T>& beam = trace.incident(i);
    const Vector3<T>& normal = trace.normal[i];
    const Vector3<T> to_face{face_position[i] - before.x, -before.y, -before.z};
    // length = normal . to_face / normal . beam
    const T numerator_bar = dot(origin_bar, beam) * path.over_cosine[i];
    const T cosine_bar = -(numerator_bar * path.length[i]);
    out.incident[i] = path.length[i] * origin_bar + cosine_bar * normal;
    out.normal[i] = numerator_bar * to_face + cosine_bar * beam;
    out.face_position[i] = numerator_bar * normal.x;
    origin_bar = origin_bar - numerator_bar * normal;
  }
  out.face_position[0] = origin_bar.x;
  return out;
}

/// A beam as a line in space.
struct Ray {
  Vector3<double> origin;     ///< exit point on the last face, m, sensor frame
  Vector3<double> direction;  ///< unit vector, sensor frame
  bool valid = false;         ///< when false, all others are NaN
};

/// The ray of one shot.
/// @param rotation_angles  [prisms], rad, beam order
/// @param beam             number of the emitter, counted from 0
/// @throws InvalidArgument when there are not as many angles as prisms, and as check_beam() and
///         face_positions()
Ray emergent_ray(const PrismTrain& train, const PrismGeometry& geometry,
                 std::span<const double> rotation_angles, int beam = 0);

}  // namespace risley
