// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <type_traits>

#include "risley/optics/observation_model.hpp"

namespace risley {

/// Derivatives of one result with respect to the flat parameter vector and the rotation angles.
template <ModelScalar T, TrainLayout N>
struct Gradient {
  std::array<T, parameter_count(N)> parameters;
  std::array<T, N> rotation_angles;
};

/// The derivative by one place of the whole flat vector, for a shot of one emitter.
template <ModelScalar T, TrainLayout N>
T derivative_by(const Gradient<T, N>& gradient, int at, int beam) {
  const int emitter = place::emitter(at, N);
  if (emitter < 0) return gradient.parameters[static_cast<std::size_t>(at)];
  if (emitter != beam) return T(0.0);
  const int first = at - place::incident_beam_horizontal(emitter, N);  // 0 horizontal, 1 vertical
  return gradient.parameters[static_cast<std::size_t>(place::incident_beam_horizontal() + first)];
}

/// A train's part of the derivatives, computed once for all shots.
template <ModelScalar T, TrainLayout N>
struct PreparedDerivatives {
  /// A small turn of both normals about an axis w changes a result by w times its torque: see
  /// reverse_prism(). Each of these is such an axis, per unit of the parameter.
  struct Prism {
    Vector3<T> rotation;  ///< of the rotation angle
    TurningVector<T> tilt_horizontal, tilt_vertical, bearing_vertical;
    TurningVector<T> wedge;  ///< d normal of the angled face or mirror / d its angle
    T wedge_by_other{};      ///< that times the normal of the other of the first two: constant
    T wedge_by_exit{};       ///< that times the normal of a reflector's last face: constant
    T first_is_angled{}, second_is_angled{};        ///< one is 1, the other 0
    std::array<T, 2> ratio_by_glass, ratio_by_air;  ///< d index ratio / d refractive indices
    /// Whether these derivatives are needed; otherwise they are zero.
    bool wedge_wanted = true, tilt_horizontal_wanted = true;
  };
  Vector3<T> incident_horizontal, incident_vertical;  ///< of the emitter that fires
  std::array<Prism, N> prisms;
};

/// Default filter of prepare_derivatives(): all derivatives are needed.
struct AllWanted {
  constexpr bool operator()(int) const { return true; }
};

/// One prism of prepare_derivatives().
/// @param parameters,sines  as prepare_prism()
template <ModelScalar T, TrainLayout N, class Parameters, class Sines, class Wanted>
void prepare_prism_derivatives(const Parameters& parameters, FaceOrder order, const Sines& sines,
                               const Wanted& wanted, std::size_t prism,
                               PreparedDerivatives<T, N>& derivatives) {
  const int number = static_cast<int>(prism);
  const T zero(0.0), one(1.0);
  SinePair<T> level_angle{zero, one};
  PrismAxis<T> axis = prism_axis<T, N>(sines, prism);
  auto&& horizontal = sines[leaning::horizontal(prism)];
  // Horizontal angles turn a leaning direction about -Z, vertical ones about a level vector.
  Vector3<T> level = leaning_horizontal_rate<T>(horizontal, level_angle);
  auto& out = derivatives.prisms[prism];
  out.rotation = axis.direction;
  out.tilt_vertical = turning_about(axis.direction, level);
  out.tilt_horizontal_wanted = wanted(place::prism_tilt_horizontal(number));
  if (out.tilt_horizontal_wanted) {
    out.tilt_horizontal = turning_about(axis.direction, Vector3<T>{zero, zero, T(-1.0)});
  }
  if (N.has_bearing(prism)) {
    // The axis and everything that turns about it lean together, except for the part due to the
    // tilts.
    Vector3<T> bearing_level = leaning_horizontal_rate<T>(axis.horizontal, level_angle);
    out.bearing_vertical = turning_about(axis.direction, level - bearing_level);
    out.bearing_vertical.along = out.bearing_vertical.along + bearing_level;
  }
  const bool wedge_kind = N.kind[prism] == ElementKind::wedge;
  out.wedge_wanted = wanted(place::wedge_angle(number)) ||
                     (wedge_kind && wanted(place::prism_tilt_vertical(number)));
  if (out.wedge_wanted) {
    const std::size_t angled = wedge_sign(order, 0) != 0 ? 0 : 1, other = 1 - angled;
    const T sign(wedge_sign(order, static_cast<int>(angled)));
    Vector3<T> wedge =
        sign * leaning_vertical_rate<T>(horizontal, sines[leaning::vertical(prism, angled)]);
    out.wedge = turning_about(axis.direction, wedge);
    out.wedge_by_other = dot(wedge, normal_at_zero<T>(sines, prism, other));
    if constexpr (N.reflects()) {
      if (N.is_reflector(prism)) {
        out.wedge_by_exit = dot(wedge, normal_at_zero<T>(sines, prism, 2));
      }
    }
    out.first_is_angled = T(angled == 0 ? 1.0 : 0.0);
    out.second_is_angled = T(angled == 0 ? 0.0 : 1.0);
  }
  // Ratios: air / glass into the prism, glass / air out of it.
  auto&& air = parameters[static_cast<std::size_t>(place::refractive_index_air())];
  auto&& glass = parameters[static_cast<std::size_t>(place::refractive_index(number))];
  T over_air = one / air, over_glass = one / glass;
  out.ratio_by_glass = {T(-air * over_glass * over_glass), over_air};
  out.ratio_by_air = {over_glass, T(-glass * over_air * over_air)};
}

/// The incident beam of prepare_derivatives(). @param sines  as prepare_prism()
template <ModelScalar T, TrainLayout N, class Sines>
void prepare_incident_derivatives(const Sines& sines, PreparedDerivatives<T, N>& derivatives) {
  auto&& horizontal = sines[leaning::incident_horizontal()];
  auto&& vertical = sines[leaning::incident_vertical()];
  derivatives.incident_horizontal = leaning_horizontal_rate<T>(horizontal, vertical);
  derivatives.incident_vertical = leaning_vertical_rate<T>(horizontal, vertical);
}

/// @copydoc prepare
/// @param wanted  called with a place of the flat vector of a train with one emitter: if it returns
/// false, the most expensive derivatives are skipped and are zero
template <ModelScalar T, TrainLayout N, class Wanted = AllWanted>
PreparedDerivatives<T, N> prepare_derivatives(const std::array<T, parameter_count(N)>& parameters,
                                              const std::array<FaceOrder, N>& face_order,
                                              const Wanted& wanted = {}) {
  const auto sines = sines_of(leaning_angles<T, N>(parameters, face_order));
  PreparedDerivatives<T, N> derivatives;
  prepare_incident_derivatives(sines, derivatives);
#pragma GCC unroll 4
  for (std::size_t prism = 0; prism < kElements<N>; ++prism) {
    prepare_prism_derivatives(parameters, face_order[prism], sines, wanted, prism, derivatives);
  }
  return derivatives;
}

/// For results that depend only on the beam after the last face.
struct NothingAtFaces {
  template <class Vector>
  void operator()(std::size_t, std::size_t, Vector&, Vector&) const {}
};

/// State of the reverse passes of some results, from the last prism to the first.
template <ModelScalar T, TrainLayout N, std::size_t Results>
struct ReversePass {
  std::array<Gradient<T, N>, Results> gradients;
  std::array<Vector3<T>, Results> beam;    ///< d result / d beam before the element that is next
  std::array<Vector3<T>, Results> torque;  ///< that beam x d result / d beam
  std::array<T, Results> air;              ///< d result / d refractive index of the air, so far
};

/// @param direction  the emergent beam, sensor frame
/// @param seeds      d result / d direction [results][3]
template <TrainLayout N, ModelScalar T, std::size_t Results>
ReversePass<T, N, Results> begin_reverse(const Vector3<T>& direction,
                                         const std::array<Vector3<T>, Results>& seeds) {
  ReversePass<T, N, Results> pass;
#pragma GCC unroll 3
  for (std::size_t r = 0; r < Results; ++r) {
    pass.beam[r] = in_train_frame<N>(seeds[r]);
    pass.torque[r] = cross(in_train_frame<N>(direction), pass.beam[r]);
    pass.air[r] = T(0.0);
    // Where the last axis is X.
    pass.gradients[r].parameters[static_cast<std::size_t>(place::frame_yaw(N))] = T(0.0);
    pass.gradients[r].parameters[static_cast<std::size_t>(place::frame_pitch(N))] = T(0.0);
  }
  return pass;
}

/// One element of trace_adjoint(): the adjoint of pass_prism(). With g = d result / d L'' and K its
/// last face:
///   in_K' = N_K.g dk_K/din_K,  in_i' = (N_i.g / m + sum_(j > i) N_i.N_j in_j') dk_i/din_i,
///   d result / d L = g + in_1' N_1 + m sum_(j > 1) in_j' N_j.
/// Turning beam and surfaces together turns L'' with them: so the torque of all normals, the sum of
/// N x d result / d N, is L'' x g less L x d result / d L. Every angle except those of single
/// surfaces turns all normals about some axis w, and w times the torque is its derivative.
/// Derivation: docs/theory/derivatives.md
/// @param at_face  not called if an element reflects: see beam_path()
template <ModelScalar T, TrainLayout N, std::size_t Results, class AtFace = NothingAtFaces>
void reverse_prism(const PreparedTrain<T, N>& train, const PreparedDerivatives<T, N>& derivatives,
                   const Trace<T, N>& forward, std::size_t prism, ReversePass<T, N, Results>& pass,
                   const AtFace& at_face = {}) {
  constexpr bool kAtFaces = !std::is_same_v<AtFace, NothingAtFaces> && !N.reflects();
  const bool has_bearing = N.has_bearing(prism);
  const int number = static_cast<int>(prism);
  const std::size_t first = 2 * prism, surfaces = surfaces_of<N>(prism), exit = surfaces - 1;
  const auto& d = derivatives.prisms[prism];
  const T& sine = forward.sine[prism];
  const T& cosine = forward.cosine[prism];
  const T& into = train.faces[first].index_ratio;
  const T& out_of = train.faces[first + exit].index_ratio;
  const Vector3<T>& beam = forward.beam[prism];
  const T one(1.0);
  std::array<T, 3> k, k_by_in, k_by_ratio, beam_on;
#pragma GCC unroll 3
  for (std::size_t i = 0; i < surfaces; ++i) {
    // k = out - ratio in, out^2 = 1 - ratio^2 (1 - in^2)
    const T& ratio = train.faces[first + i].index_ratio;
    const T& in = forward.cosine_in[first + i];
    const T scaled = ratio / forward.cosine_out[first + i];
    k[i] = forward.cosine_out[first + i] - ratio * in;
    k_by_in[i] = ratio * (scaled * in - one);
    k_by_ratio[i] = -(scaled * (one - in * in) + in);
    if (i > 0) beam_on[i] = dot(beam, forward.normal[first + i]);
  }
  const Vector3<T> tilt_vertical = d.tilt_vertical.at(sine, cosine);
  const T zero(0.0);
  Vector3<T> tilt_horizontal{zero, zero, zero}, wedge{zero, zero, zero};
  T wedge_on_beam = zero, wedge_k = zero;
  if (d.tilt_horizontal_wanted) tilt_horizontal = d.tilt_horizontal.at(sine, cosine);
  if (d.wedge_wanted) {
    wedge = d.wedge.at(sine, cosine);
    wedge_on_beam = dot(wedge, beam);
    wedge_k = d.first_is_angled * (out_of * k[0]) +
              d.second_is_angled * (exit == 1 ? k[1] : T(out_of * k[1]));
  }
  Vector3<T> bearing_vertical;
  if (has_bearing) bearing_vertical = d.bearing_vertical.at(sine, cosine);
#pragma GCC unroll 3
  for (std::size_t r = 0; r < Results; ++r) {
    Gradient<T, N>& gradient = pass.gradients[r];
    const auto by = [&gradient](int where) -> T& {
      return gradient.parameters[static_cast<std::size_t>(where)];
    };
    const Vector3<T> behind = pass.beam[r];
    Vector3<T> inside, at_second, before, at_first;
    if constexpr (kAtFaces) {
      inside = at_second = before = at_first = Vector3<T>{zero, zero, zero};
      at_face(first + 1, r, inside, at_second);
      at_face(first, r, before, at_first);
    }
    std::array<T, 3> along, in_bar;
#pragma GCC unroll 3
    for (std::size_t i = 0; i < surfaces; ++i) along[i] = dot(forward.normal[first + i], behind);
    in_bar[exit] = along[exit] * k_by_in[exit];
    T k_bar = zero;  // of the first face after the loop
#pragma GCC unroll 2
    for (std::size_t step = 1; step <= exit; ++step) {
      const std::size_t i = exit - step;
      k_bar = out_of * along[i];
#pragma GCC unroll 2
      for (std::size_t j = i + 1; j < surfaces; ++j) {
        k_bar = k_bar + train.cosine_between[pair_of_surfaces<N>(prism, i, j)] * in_bar[j];
      }
      if constexpr (kAtFaces)
        k_bar = k_bar + dot(forward.normal[first], inside);  // L' = m L + k1 N1
      in_bar[i] = k_bar * k_by_in[i];
    }
    T into_bar = beam_on[1] * in_bar[1];
    T out_of_bar = along[0] * k[0];
    Vector3<T>& ahead = pass.beam[r];
    ahead = behind + in_bar[0] * forward.normal[first];
#pragma GCC unroll 2
    for (std::size_t i = 1; i < surfaces; ++i) {
      ahead = ahead + T(into * in_bar[i]) * forward.normal[first + i];
      if (i == exit) continue;
      into_bar = into_bar + beam_on[i + 1] * in_bar[i + 1];
      out_of_bar = out_of_bar + along[i] * k[i];
    }
    if constexpr (kAtFaces) into_bar = into_bar + dot(beam, inside);
    into_bar = into_bar + k_bar * k_by_ratio[0];
    out_of_bar = out_of_bar + along[exit] * k_by_ratio[exit];
    if constexpr (kAtFaces) ahead = ahead + into * inside;
    const Vector3<T> torque_ahead = cross(beam, ahead);
    Vector3<T> torque = pass.torque[r] - torque_ahead;
    T wedge_bar = zero;
    if (d.wedge_wanted) {
      wedge_bar = wedge_k * dot(wedge, behind) +
                  T(d.first_is_angled * in_bar[0] + d.second_is_angled * (into * in_bar[1])) *
                      wedge_on_beam +
                  k[0] * in_bar[1] * d.wedge_by_other;
      if (exit == 2) wedge_bar = wedge_bar + k[1] * in_bar[2] * d.wedge_by_exit;
    }
    pass.torque[r] = torque_ahead;
    if constexpr (kAtFaces) {
      torque = torque + cross(forward.inside[prism], inside) +
               cross(forward.normal[first], at_first) + cross(forward.normal[first + 1], at_second);
      wedge_bar = wedge_bar + d.first_is_angled * dot(wedge, k[0] * inside + at_first) +
                  d.second_is_angled * dot(wedge, at_second);
      ahead = ahead + before;
      pass.torque[r] = cross(beam, ahead);
    }
    gradient.rotation_angles[prism] = has_bearing ? dot(d.rotation, torque) : torque.x;
    by(place::prism_tilt_horizontal(number)) =
        d.tilt_horizontal_wanted ? dot(tilt_horizontal, torque) : zero;
    by(place::prism_tilt_vertical(number)) = dot(tilt_vertical, torque);
    if (N.kind[prism] == ElementKind::wedge) {  // of its first face alone
      by(place::prism_tilt_vertical(number)) = by(place::prism_tilt_vertical(number)) - wedge_bar;
    }
    by(place::wedge_angle(number)) = wedge_bar;
    if (has_bearing) {
      by(place::bearing_tilt_horizontal(number)) = -torque.z;
      by(place::bearing_tilt_vertical(number)) = dot(bearing_vertical, torque);
    }
    by(place::refractive_index(number)) =
        into_bar * d.ratio_by_glass[0] + out_of_bar * d.ratio_by_glass[1];
    pass.air[r] = pass.air[r] + into_bar * d.ratio_by_air[0] + out_of_bar * d.ratio_by_air[1];
  }
}

/// After the first prism: the derivatives by the incident beam and by the air.
template <ModelScalar T, TrainLayout N, std::size_t Results>
void end_reverse(const PreparedDerivatives<T, N>& d, ReversePass<T, N, Results>& pass) {
#pragma GCC unroll 3
  for (std::size_t r = 0; r < Results; ++r) {
    auto& parameters = pass.gradients[r].parameters;
    parameters[place::refractive_index_air()] = pass.air[r];
    parameters[place::incident_beam_horizontal()] = dot(pass.beam[r], d.incident_horizontal);
    parameters[place::incident_beam_vertical()] = dot(pass.beam[r], d.incident_vertical);
  }
}

/// Reverse pass: the gradients of some scalar results from their derivatives with respect to the
/// emergent direction, all at once because they share the motion of the faces.
/// @param seeds    d result / d direction [results][3]
/// @param at_face called as (face, result, beam, normal): adds to d result / d incident beam of the
/// face and d result / d its normal the part that does not come through the refraction
template <ModelScalar T, TrainLayout N, std::size_t Results, class AtFace = NothingAtFaces>
std::array<Gradient<T, N>, Results> trace_adjoint(const PreparedTrain<T, N>& train,
                                                  const PreparedDerivatives<T, N>& d,
                                                  const Trace<T, N>& forward,
                                                  const std::array<Vector3<T>, Results>& seeds,
                                                  const AtFace& at_face = {}) {
  auto pass = begin_reverse<N>(forward.direction(), seeds);
#pragma GCC unroll 4
  for (std::size_t i = 0; i < kElements<N>; ++i)
    reverse_prism(train, d, forward, N - 1 - i, pass, at_face);
  end_reverse(d, pass);
  return pass.gradients;
}

/// d azimuth and d zenith / d direction [3]; NaN on the Z axis, where azimuth has no derivative.
template <ModelScalar T>
struct AngleSeeds {
  Vector3<T> azimuth, zenith;
};

/// Derivatives of both angles by a direction of length 1: the starting point of trace_adjoint().
template <ModelScalar T>
AngleSeeds<T> angle_seeds(const Vector3<T>& direction) {
  using std::sqrt;
  const Vector3<T>& v = direction;
  const T horizontal = sqrt(v.x * v.x + v.y * v.y);
  const T over = T(1.0) / horizontal;
  const T over2 = over * over, zx = v.z * over;
  return {{-v.y * over2, v.x * over2, T(0.0)}, {v.x * zx, v.y * zx, -horizontal}};
}

/// Azimuth and zenith of one shot and their gradients.
template <ModelScalar T, TrainLayout N>
struct AngleLinearisation {
  Vector3<T> direction;
  SphericalAngles<T> angles;
  Gradient<T, N> azimuth, zenith;
  Mask<T> valid;
};

/// One shot: its direction, azimuth and zenith, and the gradients of both angles.
template <ModelScalar T, TrainLayout N>
AngleLinearisation<T, N> linearise_angles(const PreparedTrain<T, N>& train,
                                          const PreparedDerivatives<T, N>& derivatives,
                                          const RotationAngles<T, N>& rotation_angle) {
  const Trace<T, N> forward = trace_forward(train, rotation_angle);
  const AngleSeeds<T> seeds = angle_seeds(forward.direction());
  const auto gradients = trace_adjoint(train, derivatives, forward,
                                       std::array<Vector3<T>, 2>{seeds.azimuth, seeds.zenith});
  return {forward.direction(), angles_from_unit_vector(forward.direction()), gradients[0],
          gradients[1], forward.valid()};
}

/// Effect of a small turn of a direction about the Z axis (yaw) and the Y axis (pitch) of the
/// train's frame, whose X is the axis of rotation, on its angles.
template <ModelScalar T>
struct TurnDerivatives {
  T azimuth_by_yaw, zenith_by_yaw, azimuth_by_pitch, zenith_by_pitch;
};

/// @param direction  sensor frame, not along the Z axis
template <TrainLayout N, ModelScalar T>
TurnDerivatives<T> turn_derivatives(const Vector3<T>& direction) {
  using std::sqrt;
  const Vector3<T>& v = direction;
  const T horizontal2 = v.x * v.x + v.y * v.y;
  const T horizontal = sqrt(horizontal2);
  const T azimuth_about_y = -v.y * v.z / horizontal2, zenith_about_y = v.x / horizontal;
  if constexpr (N.axis_up) {  // Z is the sensor's Y, and Y its X
    return {azimuth_about_y, zenith_about_y, T(-v.x * v.z / horizontal2), T(-v.y / horizontal)};
  } else {
    return {T(1.0), T(0.0), azimuth_about_y, zenith_about_y};
  }
}

/// Fills the places of place::frame_yaw and place::frame_pitch with turn_derivatives(). No other
/// function of this file writes there unless the last axis leans, which a free turn holds.
template <ModelScalar T, TrainLayout N>
void add_turn_derivatives(AngleLinearisation<T, N>& shot) {
  constexpr auto kYaw = static_cast<std::size_t>(place::frame_yaw(N));
  constexpr auto kPitch = static_cast<std::size_t>(place::frame_pitch(N));
  const TurnDerivatives<T> turn = turn_derivatives<N>(shot.direction);
  shot.azimuth.parameters[kYaw] = turn.azimuth_by_yaw;
  shot.zenith.parameters[kYaw] = turn.zenith_by_yaw;
  shot.azimuth.parameters[kPitch] = turn.azimuth_by_pitch;
  shot.zenith.parameters[kPitch] = turn.zenith_by_pitch;
}

/// The three components of the direction of one shot and their gradients.
template <ModelScalar T, TrainLayout N>
struct DirectionLinearisation {
  Vector3<T> direction;
  std::array<Gradient<T, N>, 3> components;
  Mask<T> valid;
};

/// One shot: its direction and the gradients of its x, y and z.
template <ModelScalar T, TrainLayout N>
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
