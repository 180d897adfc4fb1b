// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <tuple>

#include "risley/optics/observation_model.hpp"

namespace risley {

/// Derivatives of one result with respect to the flat parameter vector and the rotation angles.
template <ModelScalar T, int N>
struct Gradient {
  std::array<T, parameter_count(N)> parameters;
  std::array<T, N> rotation_angles;
};

/// What the derivatives need of a train, computed once for all shots.
template <ModelScalar T, int N>
struct PreparedDerivatives {
  /// d normal / d (prism tilt horizontal, vertical, bearing tilt horizontal, vertical). A wedge
  /// angle acts on a face as wedge_sign times the vertical tilt.
  struct Face {
    TurningVector<T> tilt_horizontal, tilt_vertical, bearing_horizontal, bearing_vertical;
    T wedge_sign;
  };
  Vector3<T> incident_horizontal, incident_vertical;
  std::array<Face, 2 * N> faces;
  T air;
  std::array<T, N> glass;
};

/// @copydoc prepare
template <ModelScalar T, int N>
PreparedDerivatives<T, N> prepare_derivatives(const std::array<T, parameter_count(N)>& parameters,
                                              const std::array<FaceOrder, N>& face_order) {
  const auto p = [&](int at) -> const T& { return parameters[static_cast<std::size_t>(at)]; };
  // Derivatives of leaning_direction with respect to its two angles.
  const auto horizontal_rate = [](const T& h, const T& v) {
    const auto [sin_h, cos_h] = sin_cos(h);
    const auto [sin_v, cos_v] = sin_cos(v);
    return Vector3<T>{-sin_h * cos_v, -cos_h * cos_v, T(0.0)};
  };
  const auto vertical_rate = [](const T& h, const T& v) {
    const auto [sin_h, cos_h] = sin_cos(h);
    const auto [sin_v, cos_v] = sin_cos(v);
    return Vector3<T>{-cos_h * sin_v, sin_h * sin_v, cos_v};
  };
  PreparedDerivatives<T, N> d;
  const T& beam_h = p(place::incident_beam_horizontal());
  const T& beam_v = p(place::incident_beam_vertical());
  d.incident_horizontal = horizontal_rate(beam_h, beam_v);
  d.incident_vertical = vertical_rate(beam_h, beam_v);
  d.air = p(place::refractive_index_air());
  for (int prism = 0; prism < N; ++prism) {
    const bool last = prism == N - 1;
    d.glass[static_cast<std::size_t>(prism)] = p(place::refractive_index(prism));
    const T bearing_h = last ? T(0.0) : p(place::bearing_tilt_horizontal(prism));
    const T bearing_v = last ? T(0.0) : p(place::bearing_tilt_vertical(prism));
    const Vector3<T> axis = leaning_direction(bearing_h, bearing_v);
    for (int side = 0; side < 2; ++side) {
      const T sign(wedge_sign(face_order[static_cast<std::size_t>(prism)], side));
      const T h = bearing_h + p(place::prism_tilt_horizontal(prism));
      const T v =
          bearing_v + p(place::prism_tilt_vertical(prism)) + sign * p(place::wedge_angle(prism));
      const Vector3<T> normal = leaning_direction(h, v);
      // The derivative of a turning vector when its normal and its axis move together.
      const auto moved = [&](const Vector3<T>& d_normal, const Vector3<T>& d_axis) {
        const Vector3<T> along =
            dot(axis, normal) * d_axis + T(dot(d_axis, normal) + dot(axis, d_normal)) * axis;
        return TurningVector<T>{along, d_normal - along,
                                cross(d_axis, normal) + cross(axis, d_normal)};
      };
      const Vector3<T> still{T(0.0), T(0.0), T(0.0)};
      auto& face = d.faces[static_cast<std::size_t>(2 * prism + side)];
      face.wedge_sign = sign;
      face.tilt_horizontal = moved(horizontal_rate(h, v), still);
      face.tilt_vertical = moved(vertical_rate(h, v), still);
      face.bearing_horizontal = moved(horizontal_rate(h, v), horizontal_rate(bearing_h, bearing_v));
      face.bearing_vertical = moved(vertical_rate(h, v), vertical_rate(bearing_h, bearing_v));
    }
  }
  return d;
}

/// Everything that one forward pass leaves behind for the reverse passes.
template <ModelScalar T, int N>
struct Trace {
  std::array<Vector3<T>, 2 * N> incident, normal;
  std::array<Refraction<T>, 2 * N> refraction;
  std::array<T, N> sine, cosine;

  const Vector3<T>& direction() const { return refraction[2 * N - 1].direction; }
  Mask<T> valid() const {
    Mask<T> all = refraction[0].valid;
    for (std::size_t i = 1; i < 2 * N; ++i) all = Mask<T>(all & refraction[i].valid);
    return all;
  }
};

/// As trace(), keeping the intermediate beams.
template <ModelScalar T, int N>
Trace<T, N> trace_forward(const PreparedTrain<T, N>& train,
                          const RotationAngles<T, N>& rotation_angle) {
  Trace<T, N> out;
  Vector3<T> beam = train.incident;
  for (std::size_t prism = 0; prism < N; ++prism) {
    std::tie(out.sine[prism], out.cosine[prism]) = sin_cos(rotation_angle[prism]);
    for (std::size_t side = 0; side < 2; ++side) {
      const std::size_t i = 2 * prism + side;
      out.incident[i] = beam;
      out.normal[i] = train.faces[i].normal.at(out.sine[prism], out.cosine[prism]);
      out.refraction[i] = refract(beam, out.normal[i], train.faces[i].index_ratio);
      beam = out.refraction[i].direction;
    }
  }
  return out;
}

/// Reverse pass: the gradient of a scalar result from its derivative with respect to the emergent
/// direction. One pass per result, whatever the number of parameters.
/// @param seed  d result / d direction [3]
template <ModelScalar T, int N>
Gradient<T, N> trace_adjoint(const PreparedTrain<T, N>& train, const PreparedDerivatives<T, N>& d,
                             const Trace<T, N>& forward, const Vector3<T>& seed) {
  Gradient<T, N> gradient;
  const auto at = [&](int where) -> T& {
    return gradient.parameters[static_cast<std::size_t>(where)];
  };
  Vector3<T> beam = seed;
  T air_bar(0.0);
  for (int prism = N - 1; prism >= 0; --prism) {
    const auto k = static_cast<std::size_t>(prism);
    const T& sine = forward.sine[k];
    const T& cosine = forward.cosine[k];
    T angle(0.0), wedge(0.0), tilt_h(0.0), tilt_v(0.0), bearing_h(0.0), bearing_v(0.0);
    std::array<T, 2> ratio_bar;
    for (int side = 1; side >= 0; --side) {
      const std::size_t i = 2 * k + static_cast<std::size_t>(side);
      Vector3<T> normal_bar;
      ratio_bar[static_cast<std::size_t>(side)] =
          refract_adjoint(forward.refraction[i], forward.incident[i], forward.normal[i],
                          train.faces[i].index_ratio, beam, normal_bar);
      const auto& face = d.faces[i];
      angle = angle + dot(normal_bar, train.faces[i].normal.turning_rate(sine, cosine));
      tilt_h = tilt_h + dot(normal_bar, face.tilt_horizontal.at(sine, cosine));
      const T vertical = dot(normal_bar, face.tilt_vertical.at(sine, cosine));
      tilt_v = tilt_v + vertical;
      wedge = wedge + face.wedge_sign * vertical;
      if (prism < N - 1) {
        bearing_h = bearing_h + dot(normal_bar, face.bearing_horizontal.at(sine, cosine));
        bearing_v = bearing_v + dot(normal_bar, face.bearing_vertical.at(sine, cosine));
      }
    }
    // Ratios: air / glass into the prism, glass / air out of it.
    const T& glass = d.glass[k];
    const T over_glass = T(1.0) / glass;
    const T over_air = T(1.0) / d.air;
    at(place::refractive_index(prism)) =
        ratio_bar[1] * over_air - ratio_bar[0] * d.air * over_glass * over_glass;
    air_bar = air_bar + ratio_bar[0] * over_glass - ratio_bar[1] * glass * over_air * over_air;
    at(place::wedge_angle(prism)) = wedge;
    at(place::prism_tilt_horizontal(prism)) = tilt_h;
    at(place::prism_tilt_vertical(prism)) = tilt_v;
    at(place::bearing_tilt_horizontal(prism)) = bearing_h;
    at(place::bearing_tilt_vertical(prism)) = bearing_v;
    gradient.rotation_angles[k] = angle;
  }
  at(place::refractive_index_air()) = air_bar;
  at(place::incident_beam_horizontal()) = dot(beam, d.incident_horizontal);
  at(place::incident_beam_vertical()) = dot(beam, d.incident_vertical);
  return gradient;
}

/// d azimuth and d zenith / d direction [3]; NaN on the Z axis, where azimuth has no derivative.
template <ModelScalar T>
struct AngleSeeds {
  Vector3<T> azimuth, zenith;
};

template <ModelScalar T>
AngleSeeds<T> angle_seeds(const Vector3<T>& direction) {
  using std::sqrt;
  const Vector3<T>& v = direction;
  const T horizontal2 = v.x * v.x + v.y * v.y;
  const T over2 = T(1.0) / horizontal2;
  const T over_all = T(1.0) / (horizontal2 + v.z * v.z);
  const T horizontal = sqrt(horizontal2);
  const T zx = v.z * over_all / horizontal;
  return {{-v.y * over2, v.x * over2, T(0.0)}, {v.x * zx, v.y * zx, -horizontal * over_all}};
}

/// Azimuth and zenith of one shot and their gradients.
template <ModelScalar T, int N>
struct AngleLinearisation {
  Vector3<T> direction;
  SphericalAngles<T> angles;
  Gradient<T, N> azimuth, zenith;
  Mask<T> valid;
};

template <ModelScalar T, int N>
AngleLinearisation<T, N> linearise_angles(const PreparedTrain<T, N>& train,
                                          const PreparedDerivatives<T, N>& derivatives,
                                          const RotationAngles<T, N>& rotation_angle) {
  const Trace<T, N> forward = trace_forward(train, rotation_angle);
  const AngleSeeds<T> seeds = angle_seeds(forward.direction());
  return {forward.direction(), angles_from_direction(forward.direction()),
          trace_adjoint(train, derivatives, forward, seeds.azimuth),
          trace_adjoint(train, derivatives, forward, seeds.zenith), forward.valid()};
}

/// The three components of the direction of one shot and their gradients.
template <ModelScalar T, int N>
struct DirectionLinearisation {
  Vector3<T> direction;
  std::array<Gradient<T, N>, 3> components;
  Mask<T> valid;
};

template <ModelScalar T, int N>
DirectionLinearisation<T, N> linearise_direction(const PreparedTrain<T, N>& train,
                                                 const PreparedDerivatives<T, N>& derivatives,
                                                 const RotationAngles<T, N>& rotation_angle) {
  const Trace<T, N> forward = trace_forward(train, rotation_angle);
  const T zero(0.0), one(1.0);
  return {forward.direction(),
          {trace_adjoint(train, derivatives, forward, Vector3<T>{one, zero, zero}),
           trace_adjoint(train, derivatives, forward, Vector3<T>{zero, one, zero}),
           trace_adjoint(train, derivatives, forward, Vector3<T>{zero, zero, one})},
          forward.valid()};
}

}  // namespace risley
