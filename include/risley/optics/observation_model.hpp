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
template <class T, TrainLayout N>
using RotationAngles = std::type_identity_t<std::array<T, static_cast<std::size_t>(N)>>;

/// Unit vector [3] that leans from X by a horizontal angle towards -Y and a vertical angle towards
/// +Z: the pattern of the incident beam, the bearing and every normal.         [B21 Eq. (13-18)]
template <ModelScalar T>
Vector3<T> leaning_direction(const SinePair<T>& horizontal, const SinePair<T>& vertical) {
  const auto& [sin_h, cos_h] = horizontal;
  const auto& [sin_v, cos_v] = vertical;
  return {cos_h * cos_v, -sin_h * cos_v, sin_v};
}
/// Derivative of leaning_direction() by its horizontal angle.
template <ModelScalar T>
Vector3<T> leaning_horizontal_rate(const SinePair<T>& horizontal, const SinePair<T>& vertical) {
  const auto& [sin_h, cos_h] = horizontal;
  const auto& [sin_v, cos_v] = vertical;
  return {-sin_h * cos_v, -cos_h * cos_v, T(0.0)};
}
/// Derivative of leaning_direction() by its vertical angle.
template <ModelScalar T>
Vector3<T> leaning_vertical_rate(const SinePair<T>& horizontal, const SinePair<T>& vertical) {
  const auto& [sin_h, cos_h] = horizontal;
  const auto& [sin_v, cos_v] = vertical;
  return {-cos_h * sin_v, sin_h * sin_v, cos_v};
}

/// The same from the angles themselves, rad.
template <ModelScalar T>
Vector3<T> leaning_direction(const T& horizontal, const T& vertical) {
  return leaning_direction<T>(sin_cos(horizontal), sin_cos(vertical));
}
/// As leaning_direction().
template <ModelScalar T>
Vector3<T> leaning_horizontal_rate(const T& horizontal, const T& vertical) {
  return leaning_horizontal_rate<T>(sin_cos(horizontal), sin_cos(vertical));
}
/// As leaning_direction().
template <ModelScalar T>
Vector3<T> leaning_vertical_rate(const T& horizontal, const T& vertical) {
  return leaning_vertical_rate<T>(sin_cos(horizontal), sin_cos(vertical));
}

/// Part of place::wedge_angle() that a surface's vertical angle contains: 0 for a perpendicular
/// face, +1 for an angled second face or a mirror, -1 for an angled first face. [B21 Eq. (15-18)]
constexpr double wedge_sign(FaceOrder order, int surface_of_element) {
  if (order == FaceOrder::angled_perpendicular) return surface_of_element == 0 ? -1.0 : 0.0;
  return surface_of_element == 1 ? 1.0 : 0.0;
}

/// A vector that turns with its prism, such as a face's unit normal: along + cos(angle) cosine +
/// sin(angle) sine. This is Rodrigues' form of the rotation that the paper writes with quaternions.
/// [B21 Eq. (19-26)]
template <ModelScalar T>
struct TurningVector {
  Vector3<T> along, cosine, sine;

  /// The vector at an angle, given by its sine and cosine.
  Vector3<T> at(const T& sin_angle, const T& cos_angle) const {
    return along + cos_angle * cosine + sin_angle * sine;
  }
  /// The same about the X axis, as the last prism turns: a third of the products are zero. It saves
  /// 2 to 3 % of a direction's time.
  Vector3<T> at_about_x(const T& sin_angle, const T& cos_angle) const {
    return {along.x, cos_angle * cosine.y + sin_angle * sine.y,
            cos_angle * cosine.z + sin_angle * sine.z};
  }
};

/// A vector that turns about an axis with a prism.
/// @param vector  at rotation angle zero
template <ModelScalar T>
TurningVector<T> turning_about(const Vector3<T>& axis, const Vector3<T>& vector) {
  const Vector3<T> along = dot(axis, vector) * axis;
  return {along, vector - along, cross(axis, vector)};
}

/// A train with everything precomputed that does not depend on the rotation angles.
template <ModelScalar T, TrainLayout N>
struct PreparedTrain {
  /// One surface of an element.
  struct Face {
    TurningVector<T> normal;
    T index_ratio;  ///< index before the face over index after it, 1 for a mirror
  };
  Vector3<T> incident;  ///< of the emitter that fires
  std::array<Face, N.surfaces()> faces;
  /// Of the normals of two surfaces of one element, which turn together: see pair_of_surfaces().
  std::array<T, N + (N.reflects() ? 2 : 0)> cosine_between;
};

/// The place in PreparedTrain::cosine_between of two surfaces of an element, one < other.
template <TrainLayout N>
constexpr std::size_t pair_of_surfaces(std::size_t element, std::size_t one, std::size_t other) {
  return other == 1 ? element : static_cast<std::size_t>(N) + one;
}

/// Surfaces of an element, a constant unless an element reflects.
template <TrainLayout N>
[[gnu::always_inline]] constexpr std::size_t surfaces_of(std::size_t element) {
  if constexpr (N.reflects()) return N.surfaces(element);
  return 2;
}

/// A direction in the sensor's frame from one in the train's frame, whose X is the axis.
template <TrainLayout N, class Vector>
[[gnu::always_inline]] constexpr decltype(auto) in_sensor_frame(const Vector& v) {
  if constexpr (N.axis_up) {
    return Vector{v.y, v.z, v.x};
  } else {
    return (v);
  }
}
/// The inverse of in_sensor_frame().
template <TrainLayout N, class Vector>
[[gnu::always_inline]] constexpr decltype(auto) in_train_frame(const Vector& v) {
  if constexpr (N.axis_up) {
    return Vector{v.z, v.x, v.y};
  } else {
    return (v);
  }
}

/// The angles by which incident beam, axes and normals lean, as places of one array, so that a
/// train prepared for every shot gets all their sines at once.
namespace leaning {
constexpr std::size_t incident_horizontal() { return 0; }  ///< of the emitter that fires
constexpr std::size_t incident_vertical() { return 1; }    ///< of the emitter that fires
/// Of both normals of a prism.
constexpr std::size_t horizontal(std::size_t prism) { return 2 + 5 * prism; }
/// Of the normal of an element's face, 0 or 1, in which the wedge or the mirror may be. The third
/// surface of a reflector is at a right angle below its tilt.
constexpr std::size_t vertical(std::size_t prism, std::size_t face) { return 3 + 5 * prism + face; }
/// Of a prism's axis; behind the end where TrainLayout::has_bearing() says that it is X.
constexpr std::size_t bearing_horizontal(std::size_t prism) { return 5 + 5 * prism; }
/// As bearing_horizontal().
constexpr std::size_t bearing_vertical(std::size_t prism) { return 6 + 5 * prism; }
/// How many there are.
constexpr std::size_t count(const TrainLayout& layout) {
  return 5 * static_cast<std::size_t>(layout.elements) + (layout.axis_up ? 2 : 0);
}
}  // namespace leaning

/// The leaning angles of a train, rad: see namespace leaning.
/// @param parameters  flat vector, SI units, see namespace place
template <ModelScalar T, TrainLayout N>
std::array<T, leaning::count(N)> leaning_angles(const std::array<T, parameter_count(N)>& parameters,
                                                const std::array<FaceOrder, N>& face_order) {
  const auto p = [&](int at) -> const T& { return parameters[static_cast<std::size_t>(at)]; };
  std::array<T, leaning::count(N)> angles;
  angles[leaning::incident_horizontal()] = p(place::incident_beam_horizontal());
  angles[leaning::incident_vertical()] = p(place::incident_beam_vertical());
#pragma GCC unroll 4
  for (std::size_t prism = 0; prism < kElements<N>; ++prism) {
    const int number = static_cast<int>(prism);
    const bool wedge = N.kind[prism] == ElementKind::wedge;  // its faces share no angle
    T horizontal = p(place::prism_tilt_horizontal(number));
    T vertical = p(place::prism_tilt_vertical(number)), second(0.0);
    if (N.has_bearing(prism)) {
      const T& bearing_horizontal = p(place::bearing_tilt_horizontal(number));
      const T& bearing_vertical = p(place::bearing_tilt_vertical(number));
      angles[leaning::bearing_horizontal(prism)] = bearing_horizontal;
      angles[leaning::bearing_vertical(prism)] = bearing_vertical;
      horizontal = bearing_horizontal + horizontal;
      vertical = bearing_vertical + vertical;
      if (wedge) second = bearing_vertical;
    }
    if (!wedge) second = vertical;
    angles[leaning::horizontal(prism)] = horizontal;
#pragma GCC unroll 2
    for (std::size_t face = 0; face < 2; ++face) {
      const double sign = wedge_sign(face_order[prism], static_cast<int>(face));
      angles[leaning::vertical(prism, face)] =
          (face == 0 ? vertical : second) + T(sign) * p(place::wedge_angle(number));
    }
  }
  return angles;
}

/// Sine and cosine of each of some angles, rad.
template <ModelScalar T, std::size_t Count>
std::array<SinePair<T>, Count> sines_of(const std::array<T, Count>& angles) {
  std::array<SinePair<T>, Count> sines;
  for (std::size_t i = 0; i < Count; ++i) sines[i] = sin_cos(angles[i]);
  return sines;
}

/// The axis about which a prism turns, Eq. (9, 13), and sine and cosine of its horizontal angle.
template <class T>
struct PrismAxis {
  Vector3<T> direction;
  SinePair<T> horizontal;
};

/// @param sines  by leaning angle: an array of SinePair<T>, or an equivalent
template <ModelScalar T, TrainLayout N, class Sines>
PrismAxis<T> prism_axis(const Sines& sines, std::size_t prism) {
  const T zero(0.0), one(1.0);
  if (!N.has_bearing(prism)) return {{one, zero, zero}, {zero, one}};
  auto&& horizontal = sines[leaning::bearing_horizontal(prism)];
  return {leaning_direction<T>(horizontal, sines[leaning::bearing_vertical(prism)]), horizontal};
}

/// The normal of an element's surface at rotation angle zero. @param sines  as prism_axis()
template <ModelScalar T, class Sines>
Vector3<T> normal_at_zero(const Sines& sines, std::size_t element, std::size_t surface) {
  auto&& horizontal = sines[leaning::horizontal(element)];
  if (surface < 2) {
    return leaning_direction<T>(horizontal, sines[leaning::vertical(element, surface)]);
  }
  const SinePair<T> first = sines[leaning::vertical(element, 0)];  // a right angle below
  return leaning_direction<T>(horizontal, SinePair<T>{-first.second, first.first});
}

/// One prism of prepare().
/// @param parameters  flat vector: an array of T, or an equivalent
/// @param sines       as prism_axis()
template <ModelScalar T, TrainLayout N, class Parameters, class Sines>
void prepare_prism(const Parameters& parameters, const Sines& sines, std::size_t prism,
                   PreparedTrain<T, N>& train) {
  const int number = static_cast<int>(prism);
  auto&& air = parameters[static_cast<std::size_t>(place::refractive_index_air())];
  auto&& glass = parameters[static_cast<std::size_t>(place::refractive_index(number))];
  Vector3<T> axis = prism_axis<T, N>(sines, prism).direction;
  const std::size_t surfaces = surfaces_of<N>(prism);
  std::array<Vector3<T>, 3> normals;
#pragma GCC unroll 3
  for (std::size_t side = 0; side < surfaces; ++side) {
    const Vector3<T>& normal = normals[side] = normal_at_zero<T>(sines, prism, side);
    auto& face = train.faces[2 * prism + side];
    face.normal = turning_about(axis, normal);
    face.index_ratio = side == 0 ? T(air / glass) : side + 1 == surfaces ? T(glass / air) : T(1.0);
#pragma GCC unroll 2
    for (std::size_t before = 0; before < side; ++before) {
      train.cosine_between[pair_of_surfaces<N>(prism, before, side)] = dot(normals[before], normal);
    }
  }
}

/// @param parameters  flat vector, SI units, see namespace place
template <ModelScalar T, TrainLayout N>
PreparedTrain<T, N> prepare(const std::array<T, parameter_count(N)>& parameters,
                            const std::array<FaceOrder, N>& face_order) {
  const auto sines = sines_of(leaning_angles<T, N>(parameters, face_order));
  PreparedTrain<T, N> train;
  train.incident = leaning_direction<T>(sines[leaning::incident_horizontal()],
                                        sines[leaning::incident_vertical()]);
#pragma GCC unroll 4
  for (std::size_t prism = 0; prism < kElements<N>; ++prism)
    prepare_prism(parameters, sines, prism, train);
  return train;
}

/// The path of one beam through all elements: the result of a forward pass for the reverse passes,
/// in the train's frame.
template <ModelScalar T, TrainLayout N>
struct Trace {
  static constexpr std::size_t kSurfaces = N.surfaces();  ///< of all elements
  std::array<T, N> sine, cosine;                          ///< of the rotation angles
  std::array<Vector3<T>, N + 1> beam;  ///< before each element and after the last, unit vectors
  std::array<Vector3<T>, N> inside;    ///< behind each element's first face: trace_forward()
  std::array<Vector3<T>, kSurfaces> normal;  ///< of the surfaces, unit vectors
  /// Of the angles of incidence and refraction at the surfaces; out is NaN from where the beam does
  /// not get through. At a mirror out = -in.
  std::array<T, kSurfaces> cosine_in, cosine_out;

  /// The emergent beam: unit vector, sensor frame; NaN if not valid.
  decltype(auto) direction() const { return in_sensor_frame<N>(beam[N]); }
  /// The beam that meets a face of a prism.
  const Vector3<T>& incident(std::size_t face) const {
    return face % 2 == 0 ? beam[face / 2] : inside[face / 2];
  }
  /// Whether the beam gets through every surface.
  Mask<T> valid() const { return Mask<T>(cosine_out[kSurfaces - 1] >= T(0.0)); }
};

/// Turns one prism. @param rotation_angle  rad
template <ModelScalar T, TrainLayout N>
void turn_prism(const T& rotation_angle, std::size_t prism, Trace<T, N>& trace) {
  const auto [sine, cosine] = sin_cos(rotation_angle);
  trace.sine[prism] = sine;
  trace.cosine[prism] = cosine;
}

/// Sends the beam through one element. Within the glass, with m and 1/m the index ratios of its
/// faces, every surface adds a part along its normal, Eq. (10):
///   L' = m L + sum k_i N_i,  k = cos_out - ratio cos_in,  of a mirror k = -2 cos_in,
/// and the last face L'' = L'/m + k_K N_K = L + 1/m sum k_i N_i + k_K N_K, where
///   N_j.L' = m N_j.L + sum k_i N_i.N_j
/// and N_i.N_j is constant: the beam within the element need not be known, which saves 4 % of a
/// direction's time.                                                         [B21 section 2.2]
/// @param[in,out] trace  sine, cosine and beam of the element are given, the rest of it is set
template <ModelScalar T, TrainLayout N>
void pass_prism(const PreparedTrain<T, N>& train, std::size_t prism, Trace<T, N>& trace) {
  const std::size_t first = 2 * prism, surfaces = surfaces_of<N>(prism);
  const T& into = train.faces[first].index_ratio;
  const T& out_of = train.faces[first + surfaces - 1].index_ratio;
  const Vector3<T>& beam = trace.beam[prism];
  Vector3<T> behind = beam;
  std::array<T, 3> k;
#pragma GCC unroll 3
  for (std::size_t i = 0; i < surfaces; ++i) {
    const std::size_t at = first + i;
    const TurningVector<T>& turning = train.faces[at].normal;
    const Vector3<T> normal = N.has_bearing(prism)
                                  ? turning.at(trace.sine[prism], trace.cosine[prism])
                                  : turning.at_about_x(trace.sine[prism], trace.cosine[prism]);
    T in = i == 0 ? dot(normal, beam) : T(into * dot(normal, beam));
#pragma GCC unroll 2
    for (std::size_t before = 0; before < i; ++before) {
      in = in + k[before] * train.cosine_between[pair_of_surfaces<N>(prism, before, i)];
    }
    const bool last = i + 1 == surfaces, mirror = i == 1 && !last;
    const T& ratio = train.faces[at].index_ratio;
    const T out = mirror ? reflection_cosine(in) : refraction_cosine(in, ratio);
    k[i] = out - ratio * in;
    behind = behind + (last ? k[i] : T(out_of * k[i])) * normal;
    trace.normal[at] = normal;
    trace.cosine_in[at] = in;
    trace.cosine_out[at] = out;
  }
  trace.beam[prism + 1] = behind;
}

/// The beam after the first face of an element, L' = m L + k1 N1. @param[in,out] trace as
/// pass_prism() left it
template <ModelScalar T, TrainLayout N>
void set_inside(const PreparedTrain<T, N>& train, std::size_t prism, Trace<T, N>& trace) {
  const std::size_t face = 2 * prism;
  const T& into = train.faces[face].index_ratio;
  trace.inside[prism] =
      into * trace.beam[prism] +
      T(trace.cosine_out[face] - into * trace.cosine_in[face]) * trace.normal[face];
}

/// Sends the beam through all prisms.                                         [B21 section 2.2]
/// @param rotation_angle  of every prism in beam order, rad
template <ModelScalar T, TrainLayout N>
Trace<T, N> trace_forward(const PreparedTrain<T, N>& train,
                          const RotationAngles<T, N>& rotation_angle) {
  Trace<T, N> out;
  out.beam[0] = train.incident;
#pragma GCC unroll 4  // gcc 12 keeps batches in registers only where indices are constants
  for (std::size_t prism = 0; prism < kElements<N>; ++prism) {
    turn_prism(rotation_angle[prism], prism, out);
    pass_prism(train, prism, out);
    set_inside(train, prism, out);
  }
  return out;
}

/// A beam that has left the sensor.
template <ModelScalar T>
struct Beam {
  Vector3<T> direction;  ///< unit vector, sensor frame; NaN if not valid
  Mask<T> valid;         ///< false when the beam does not get through the prisms
};

/// As trace_forward(), for the emergent beam only.
template <ModelScalar T, TrainLayout N>
Beam<T> trace(const PreparedTrain<T, N>& train, const RotationAngles<T, N>& rotation_angle) {
  Trace<T, N> forward;
  forward.beam[0] = train.incident;
#pragma GCC unroll 4
  for (std::size_t prism = 0; prism < kElements<N>; ++prism) {
    turn_prism(rotation_angle[prism], prism, forward);
    pass_prism(train, prism, forward);
  }
  return {forward.direction(), forward.valid()};
}

/// Direction, azimuth and zenith of one shot in plain numbers.
struct Observation {
  Vector3<double> direction;  ///< unit vector, sensor frame
  double azimuth = 0;         ///< rad, (-pi, pi]
  double zenith = 0;          ///< rad, [0, pi]
  bool valid = false;         ///< when false, all others are NaN
};

/// Direction of one shot of a train.
/// @param rotation_angles  [prisms], rad, beam order
/// @param beam             number of the emitter, counted from 0
/// @throws InvalidArgument when there are not as many angles as prisms, and as check_beam()
Observation observe(const PrismTrain& train, std::span<const double> rotation_angles, int beam = 0);

/// Ideal rotation angles at constant speed.                                     [B21 Eq. (1-2)]
inline double rotation_angle_at(double start_angle, double angular_velocity, double time) {
  return start_angle + angular_velocity * time;
}

}  // namespace risley
