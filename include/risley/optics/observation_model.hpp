// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <type_traits>

#include "risley/core/direction.hpp"
#include "risley/core/scalar.hpp"
#include "risley/core/vector3.hpp"
#include "risley/optics/prism_train.hpp"
#include "risley/optics/snell.hpp"

/// @file
/// The one physical model. Ideal and practical model are the same code: the ideal model is the
/// practical one with every error parameter zero.
namespace risley {

/// One rotation angle per prism in beam order, rad. (Not deduced: std::array counts in size_t.)
template <class T, int N>
using RotationAngles = std::type_identity_t<std::array<T, static_cast<std::size_t>(N)>>;

/// Unit vector [3] that leans from X by a horizontal angle towards -Y and a vertical angle towards
/// +Z, rad: the pattern of the incident beam, the bearing and every normal.    [B21 Eq. (13-18)]
template <ModelScalar T>
Vector3<T> leaning_direction(const T& horizontal, const T& vertical) {
  const auto [sin_h, cos_h] = sin_cos(horizontal);
  const auto [sin_v, cos_v] = sin_cos(vertical);
  return {cos_h * cos_v, -sin_h * cos_v, sin_v};
}

/// Derivative of leaning_direction() by its horizontal angle.
template <ModelScalar T>
Vector3<T> leaning_horizontal_rate(const T& horizontal, const T& vertical) {
  const auto [sin_h, cos_h] = sin_cos(horizontal);
  const auto [sin_v, cos_v] = sin_cos(vertical);
  return {-sin_h * cos_v, -cos_h * cos_v, T(0.0)};
}
/// Derivative of leaning_direction() by its vertical angle.
template <ModelScalar T>
Vector3<T> leaning_vertical_rate(const T& horizontal, const T& vertical) {
  const auto [sin_h, cos_h] = sin_cos(horizontal);
  const auto [sin_v, cos_v] = sin_cos(vertical);
  return {-cos_h * sin_v, sin_h * sin_v, cos_v};
}

/// Part of the wedge angle that a face's vertical angle contains: 0 for a perpendicular face,
/// +1 for an angled second face, -1 for an angled first face.                  [B21 Eq. (15-18)]
constexpr double wedge_sign(FaceOrder order, int face_of_prism) {
  if (order == FaceOrder::perpendicular_angled) return face_of_prism == 0 ? 0.0 : 1.0;
  return face_of_prism == 0 ? -1.0 : 0.0;
}

/// A unit normal as its prism turns: along + cos(angle) cosine + sin(angle) sine. This is
/// Rodrigues' form of the rotation that the paper writes with quaternions.     [B21 Eq. (19-26)]
template <ModelScalar T>
struct TurningVector {
  Vector3<T> along, cosine, sine;

  /// The normal at an angle, given by its sine and cosine.
  Vector3<T> at(const T& sin_angle, const T& cos_angle) const {
    return along + cos_angle * cosine + sin_angle * sine;
  }
  /// Derivative with respect to the angle.
  Vector3<T> turning_rate(const T& sin_angle, const T& cos_angle) const {
    return cos_angle * sine - sin_angle * cosine;
  }
};

/// A train with everything computed that does not depend on the rotation angles.
template <ModelScalar T, int N>
struct PreparedTrain {
  /// One face of a prism.
  struct Face {
    TurningVector<T> normal;
    T index_ratio;  ///< index before the face over index behind it
  };
  Vector3<T> incident;  ///< of the emitter that fires
  std::array<Face, 2 * N> faces;
};

/// @param parameters  flat vector, SI units, see namespace place
template <ModelScalar T, int N>
PreparedTrain<T, N> prepare(const std::array<T, parameter_count(N)>& parameters,
                            const std::array<FaceOrder, N>& face_order) {
  const auto p = [&](int at) -> const T& { return parameters[static_cast<std::size_t>(at)]; };
  PreparedTrain<T, N> train;
  train.incident = leaning_direction(p(place::incident_beam_horizontal()),
                                     p(place::incident_beam_vertical()));  // Eq. (14)
  const T& air = p(place::refractive_index_air());
  for (int prism = 0; prism < N; ++prism) {
    const bool last = prism == N - 1;
    const T bearing_h = last ? T(0.0) : p(place::bearing_tilt_horizontal(prism));
    const T bearing_v = last ? T(0.0) : p(place::bearing_tilt_vertical(prism));
    const Vector3<T> axis = leaning_direction(bearing_h, bearing_v);  // Eq. (9), (13)
    for (int side = 0; side < 2; ++side) {
      const double sign = wedge_sign(face_order[static_cast<std::size_t>(prism)], side);
      const Vector3<T> normal = leaning_direction(  // Eq. (15-18)
          T(bearing_h + p(place::prism_tilt_horizontal(prism))),
          T(bearing_v + p(place::prism_tilt_vertical(prism)) +
            T(sign) * p(place::wedge_angle(prism))));
      auto& face = train.faces[static_cast<std::size_t>(2 * prism + side)];
      const Vector3<T> along = dot(axis, normal) * axis;
      face.normal = {along, normal - along, cross(axis, normal)};
      const T& glass = p(place::refractive_index(prism));
      face.index_ratio = side == 0 ? air / glass : glass / air;
    }
  }
  return train;
}

/// A beam that has left the sensor.
template <ModelScalar T>
struct Beam {
  Vector3<T> direction;  ///< unit vector, sensor frame; NaN where not valid
  Mask<T> valid;         ///< false when the beam does not get through the prisms
};

/// Sends the beam through all faces.                                          [B21 section 2.2]
/// @param rotation_angle  of every prism in beam order, rad
template <ModelScalar T, int N>
Beam<T> trace(const PreparedTrain<T, N>& train, const RotationAngles<T, N>& rotation_angle) {
  Vector3<T> beam = train.incident;
  Mask<T> valid = Mask<T>(T(0.0) >= T(0.0));
  for (std::size_t prism = 0; prism < N; ++prism) {
    const auto [sine, cosine] = sin_cos(rotation_angle[prism]);
    for (std::size_t side = 0; side < 2; ++side) {
      const auto& face = train.faces[2 * prism + side];
      const auto refraction = refract(beam, face.normal.at(sine, cosine), face.index_ratio);
      beam = refraction.direction;
      valid = Mask<T>(valid & refraction.valid);
    }
  }
  return {beam, valid};
}

/// Direction, azimuth and zenith of one shot in plain numbers.
struct Observation {
  Vector3<double> direction;  ///< unit vector, sensor frame
  double azimuth = 0;         ///< rad, (-pi, pi]
  double zenith = 0;          ///< rad, [0, pi]
  bool valid = false;         ///< when false, all others are NaN
};

/// Where one shot of a train points.
/// @param rotation_angles  [prisms], rad, beam order
/// @param beam             number of the emitter, counted from 0
/// @throws InvalidArgument when there are not as many angles as prisms, and as check_beam()
Observation observe(const PrismTrain& train, std::span<const double> rotation_angles, int beam = 0);

/// Ideal rotation angles at constant speed.                                     [B21 Eq. (1-2)]
inline double rotation_angle_at(double start_angle, double angular_velocity, double time) {
  return start_angle + angular_velocity * time;
}

}  // namespace risley
