// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>

#include "risley/core/scalar.hpp"
#include "risley/core/vector3.hpp"

namespace risley {

/// Cosine of the angle of refraction, from sin^2 = m^2 (1 - cos^2): NaN at total internal
/// reflection and for a face met from behind.
/// @param cosine_in    of the angle of incidence
/// @param index_ratio  m: index before the face over index behind it, > 0
template <ModelScalar T>
T refraction_cosine(const T& cosine_in, const T& index_ratio) {
  using std::sqrt;
  const T squared = T(1.0) - index_ratio * index_ratio * (T(1.0) - cosine_in * cosine_in);
  // The root of a negative number is NaN already.
  return select(Mask<T>(cosine_in >= T(0.0)), T(sqrt(squared)),
                T(std::numeric_limits<double>::quiet_NaN()));
}

/// refraction_cosine() for a mirror, whose index ratio is 1: NaN if it is met from behind.
/// @param cosine_in  of the angle of incidence
template <ModelScalar T>
T reflection_cosine(const T& cosine_in) {
  return select(Mask<T>(cosine_in >= T(0.0)), T(-cosine_in),
                T(std::numeric_limits<double>::quiet_NaN()));
}

/// Reflects one beam at one plane. @param normal  unit vector, on either side of the mirror
template <ModelScalar T>
Vector3<T> reflect(const Vector3<T>& incident, const Vector3<T>& normal) {
  return incident - T(T(2.0) * dot(normal, incident)) * normal;
}

/// Refracts one beam at one plane.                                                [B21 Eq. (10)]
/// @param incident     unit vector along propagation, sensor frame
/// @param normal       unit vector of the face, sensor frame, on the side the beam leaves to
/// @param index_ratio  index before the face over index behind it, > 0
/// @return unit vector, sensor frame; NaN if refraction_cosine() is
template <ModelScalar T>
Vector3<T> refract(const Vector3<T>& incident, const Vector3<T>& normal, const T& index_ratio) {
  const T cosine_in = dot(normal, incident);
  const T cosine_out = refraction_cosine(cosine_in, index_ratio);
  return index_ratio * incident + T(cosine_out - index_ratio * cosine_in) * normal;
}

}  // namespace risley
