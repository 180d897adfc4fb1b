// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <tuple>

#include "risley/optics/observation_model.hpp"

namespace risley {

/// Derivatives of one result with respect to the flat parameter vector and the rotation angles.
template <ModelScalar T, int N>
struct Gradient {
  std::array<T, parameter_count(N)> parameters;
  std::array<T, N> rotation_angles;
};

/// The derivative by one place of the whole flat vector, for a shot of one emitter.
template <ModelScalar T, int N>
T derivative_by(const Gradient<T, N>& gradient, int at, int beam) {
  const int emitter = place::emitter(at, N);
  if (emitter < 0) return gradient.parameters[static_cast<std::size_t>(at)];
  if (emitter != beam) return T(0.0);
  const int first = at - place::incident_beam_horizontal(emitter, N);  // 0 horizontal, 1 vertical
  return gradient.parameters[static_cast<std::size_t>(place::incident_beam_horizontal() + first)];
}

/// What the derivatives need of a train, computed once for all shots.
template <ModelScalar T, int N>
struct PreparedDerivatives {
  /// d normal / d (prism tilt horizontal, vertical, bearing tilt horizontal, vertical). A wedge
  /// angle acts on a face as wedge_sign times the vertical tilt.
  struct Face {
    TurningVector<T> tilt_horizontal, tilt_vertical, bearing_horizontal, bearing_vertical;
    T wedge_sign;
    T ratio_by_glass, ratio_by_air;  ///< d index ratio / d refractive indices
  };
  Vector3<T> incident_horizontal, incident_vertical;  ///< of the emitter that fires
  std::array<Face, 2 * N> faces;
};

/// @copydoc prepare
template <ModelScalar T, int N>
PreparedDerivatives<T, N> prepare_derivatives(const std::array<T, parameter_count(N)>& parameters,
                                              const std::array<FaceOrder, N>& face_order) {
  const auto p = [&](int at) -> const T& { return parameters[static_cast<std::size_t>(at)]; };
  PreparedDerivatives<T, N> d;
  const T& beam_h = p(place::incident_beam_horizontal());
  const T& beam_v = p(place::incident_beam_vertical());
  d.incident_horizontal = leaning_horizontal_rate(beam_h, beam_v);
  d.incident_vertical = leaning_vertical_rate(beam_h, beam_v);
  const T& air = p(place::refractive_index_air());
  for (int prism = 0; prism < N; ++prism) {
    const bool last = prism == N - 1;
    const T& glass = p(place::refractive_index(prism));
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
      // Ratios: air / glass into the prism, glass / air out of it.
      face.ratio_by_glass = side == 0 ? -air / (glass * glass) : T(1.0) / air;
      face.ratio_by_air = side == 0 ? T(1.0) / glass : -glass / (air * air);
      face.tilt_horizontal = moved(leaning_horizontal_rate(h, v), still);
      face.tilt_vertical = moved(leaning_vertical_rate(h, v), still);
      face.bearing_horizontal =
          moved(leaning_horizontal_rate(h, v), leaning_horizontal_rate(bearing_h, bearing_v));
      face.bearing_vertical =
          moved(leaning_vertical_rate(h, v), leaning_vertical_rate(bearing_h, bearing_v));
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

  /// The emergent beam: unit vector, sensor frame.
  const Vector3<T>& direction() const { return refraction[2 * N - 1].direction; }
  /// Whether the beam gets through every face.
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
#pragma GCC unroll 4  // gcc 12 keeps batches in registers only where indices are constants
  for (std::size_t prism = 0; prism < N; ++prism) {
    std::tie(out.sine[prism], out.cosine[prism]) = sin_cos(rotation_angle[prism]);
#pragma GCC unroll 2
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

/// For results that depend on the beam behind the last face alone.
struct NothingAtFaces {
  template <class Vector>
  void operator()(std::size_t, std::size_t, Vector&, Vector&) const {}
};

/// Reverse pass: the gradients of some scalar results from their derivatives with respect to the
/// emergent direction, all at once because they share how the faces move.
/// @param seeds    d result / d direction [results][3]
/// @param at_face  called as (face, result, beam, normal): adds to d result / d incident beam of
///                 the face and d result / d its normal what does not come through the refraction
template <ModelScalar T, int N, std::size_t Results, class AtFace = NothingAtFaces>
std::array<Gradient<T, N>, Results> trace_adjoint(const PreparedTrain<T, N>& train,
                                                  const PreparedDerivatives<T, N>& d,
                                                  const Trace<T, N>& forward,
                                                  const std::array<Vector3<T>, Results>& seeds,
                                                  const AtFace& at_face = {}) {
  std::array<Gradient<T, N>, Results> gradients;
  std::array<Vector3<T>, Results> beams = seeds;
  std::array<T, Results> air_bar;
  for (T& bar : air_bar) bar = T(0.0);
#pragma GCC unroll 4
  for (int prism = N - 1; prism >= 0; --prism) {
    const auto k = static_cast<std::size_t>(prism);
    const bool last = prism == N - 1;
    const T& sine = forward.sine[k];
    const T& cosine = forward.cosine[k];
    for (Gradient<T, N>& gradient : gradients) {
      gradient.rotation_angles[k] = T(0.0);
      for (int i = 3 + 6 * prism; i < 9 + 6 * prism; ++i) {
        gradient.parameters[static_cast<std::size_t>(i)] = T(0.0);
      }
    }
#pragma GCC unroll 2
    for (int side = 1; side >= 0; --side) {
      const std::size_t i = 2 * k + static_cast<std::size_t>(side);
      const auto& face = d.faces[i];
      const Vector3<T> turning = train.faces[i].normal.turning_rate(sine, cosine);
      const Vector3<T> tilt_horizontal = face.tilt_horizontal.at(sine, cosine);
      const Vector3<T> tilt_vertical = face.tilt_vertical.at(sine, cosine);
      Vector3<T> bearing_horizontal, bearing_vertical;
      if (!last) {
        bearing_horizontal = face.bearing_horizontal.at(sine, cosine);
        bearing_vertical = face.bearing_vertical.at(sine, cosine);
      }
#pragma GCC unroll 3
      for (std::size_t r = 0; r < Results; ++r) {
        Gradient<T, N>& gradient = gradients[r];
        const auto add = [&](int where, const T& value) {
          T& sum = gradient.parameters[static_cast<std::size_t>(where)];
          sum = sum + value;
        };
        Vector3<T> normal_bar;
        const T ratio_bar =
            refract_adjoint(forward.refraction[i], forward.incident[i], forward.normal[i],
                            train.faces[i].index_ratio, beams[r], normal_bar);
        at_face(i, r, beams[r], normal_bar);
        gradient.rotation_angles[k] = gradient.rotation_angles[k] + dot(normal_bar, turning);
        const T vertical = dot(normal_bar, tilt_vertical);
        add(place::prism_tilt_horizontal(prism), dot(normal_bar, tilt_horizontal));
        add(place::prism_tilt_vertical(prism), vertical);
        add(place::wedge_angle(prism), face.wedge_sign * vertical);
        if (!last) {
          add(place::bearing_tilt_horizontal(prism), dot(normal_bar, bearing_horizontal));
          add(place::bearing_tilt_vertical(prism), dot(normal_bar, bearing_vertical));
        }
        add(place::refractive_index(prism), ratio_bar * face.ratio_by_glass);
        air_bar[r] = air_bar[r] + ratio_bar * face.ratio_by_air;
      }
    }
  }
  for (std::size_t r = 0; r < Results; ++r) {
    auto& parameters = gradients[r].parameters;
    parameters[place::refractive_index_air()] = air_bar[r];
    parameters[place::incident_beam_horizontal()] = dot(beams[r], d.incident_horizontal);
    parameters[place::incident_beam_vertical()] = dot(beams[r], d.incident_vertical);
  }
  return gradients;
}

/// d azimuth and d zenith / d direction [3]; NaN on the Z axis, where azimuth has no derivative.
template <ModelScalar T>
struct AngleSeeds {
  Vector3<T> azimuth, zenith;
};

/// Derivatives of both angles by a direction: what trace_adjoint() starts from.
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

/// One shot: its direction, azimuth and zenith, and the gradients of both angles.
template <ModelScalar T, int N>
AngleLinearisation<T, N> linearise_angles(const PreparedTrain<T, N>& train,
                                          const PreparedDerivatives<T, N>& derivatives,
                                          const RotationAngles<T, N>& rotation_angle) {
  const Trace<T, N> forward = trace_forward(train, rotation_angle);
  const AngleSeeds<T> seeds = angle_seeds(forward.direction());
  const auto gradients = trace_adjoint(train, derivatives, forward,
                                       std::array<Vector3<T>, 2>{seeds.azimuth, seeds.zenith});
  return {forward.direction(), angles_from_direction(forward.direction()), gradients[0],
          gradients[1], forward.valid()};
}

/// Fills the places of place::frame_yaw and place::frame_pitch: what a small turn of the emergent
/// beam about Z and about Y does to both angles. No other function of this file writes there.
template <ModelScalar T, int N>
void add_turn_derivatives(AngleLinearisation<T, N>& shot) {
  using std::sqrt;
  constexpr auto kYaw = static_cast<std::size_t>(place::frame_yaw(N));
  constexpr auto kPitch = static_cast<std::size_t>(place::frame_pitch(N));
  const Vector3<T>& v = shot.direction;
  const T horizontal2 = v.x * v.x + v.y * v.y;
  shot.azimuth.parameters[kYaw] = T(1.0);
  shot.zenith.parameters[kYaw] = T(0.0);
  shot.azimuth.parameters[kPitch] = -v.y * v.z / horizontal2;
  shot.zenith.parameters[kPitch] = v.x / sqrt(horizontal2);
}

/// The three components of the direction of one shot and their gradients.
template <ModelScalar T, int N>
struct DirectionLinearisation {
  Vector3<T> direction;
  std::array<Gradient<T, N>, 3> components;
  Mask<T> valid;
};

/// One shot: its direction and the gradients of its x, y and z.
template <ModelScalar T, int N>
DirectionLinearisation<T, N> linearise_direction(const PreparedTrain<T, N>& train,
                                                 const PreparedDerivatives<T, N>& derivatives,
                                                 const RotationAngles<T, N>& rotation_angle) {
  const Trace<T, N> forward = trace_forward(train, rotation_angle);
  const T zero(0.0), one(1.0);
  return {forward.direction(),
          trace_adjoint(
              train, derivatives, forward,
              std::array<Vector3<T>, 3>{Vector3<T>{one, zero, zero}, Vector3<T>{zero, one, zero},
                                        Vector3<T>{zero, zero, one}}),
          forward.valid()};
}

}  // namespace risley
