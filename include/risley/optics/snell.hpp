// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>

#include "risley/core/scalar.hpp"
#include "risley/core/vector3.hpp"

namespace risley {

/// A beam after one face, with what its derivatives need.
template <ModelScalar T>
struct Refraction {
  Vector3<T> direction;  ///< unit vector, sensor frame; NaN where not valid
  T cosine_in;           ///< of the angle of incidence
  T cosine_out;          ///< of the angle of refraction
  Mask<T> valid;         ///< false at total internal reflection and for a face met from behind
};

/// Refracts one beam at one plane.                                                [B21 Eq. (10)]
/// @param incident     unit vector along propagation, sensor frame
/// @param normal       unit vector of the face, sensor frame, on the side the beam leaves to
/// @param index_ratio  index before the face over index behind it, > 0
template <ModelScalar T>
Refraction<T> refract(const Vector3<T>& incident, const Vector3<T>& normal, const T& index_ratio) {
  using std::sqrt;
  const T cosine_in = dot(normal, incident);
  const T squared = T(1.0) - index_ratio * index_ratio * (T(1.0) - cosine_in * cosine_in);
  const Mask<T> valid = Mask<T>((squared >= T(0.0)) & (cosine_in >= T(0.0)));
  const T cosine_out = select(valid, sqrt(squared), T(std::numeric_limits<double>::quiet_NaN()));
  return {index_ratio * incident + (cosine_out - index_ratio * cosine_in) * normal, cosine_in,
          cosine_out, valid};
}

/// Adjoint of refract: takes the derivatives of some result with respect to the refracted
/// direction and gives those with respect to the inputs. With k = cosine_out - m cosine_in,
/// d cosine_out / d cosine_in = m^2 cosine_in / cosine_out and
/// d cosine_out / dm = -m (1 - cosine_in^2) / cosine_out.   Derivation: docs/theory/derivatives.md
/// @param[in]     refraction    of refract() for the same inputs
/// @param[in,out] beam          on entry d/d direction, on return d/d incident
/// @param[out]    normal_bar    d/d normal
/// @return d/d index_ratio
template <ModelScalar T>
T refract_adjoint(const Refraction<T>& refraction, const Vector3<T>& incident,
                  const Vector3<T>& normal, const T& index_ratio, Vector3<T>& beam,
                  Vector3<T>& normal_bar) {
  const T& m = index_ratio;
  const T& c = refraction.cosine_in;
  const T over_out = T(1.0) / refraction.cosine_out;
  const T along_normal = dot(beam, normal);
  const T along_incident = dot(beam, incident);
  const T k = refraction.cosine_out - m * c;
  const T cosine_bar = along_normal * (m * m * c * over_out - m);
  const T ratio_bar = along_incident - along_normal * (m * (T(1.0) - c * c) * over_out + c);
  normal_bar = k * beam + cosine_bar * incident;
  beam = m * beam + cosine_bar * normal;
  return ratio_bar;
}

}  // namespace risley
