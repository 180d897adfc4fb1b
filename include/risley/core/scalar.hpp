// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <type_traits>
#include <utility>

namespace risley {

/// A number type for the observation model: double, ceres::Jet, an SIMD batch. sqrt, sin, cos and
/// atan2 are found by argument-dependent lookup; comparisons give a mask (bool, or one bool per
/// lane).
template <class T>
concept ModelScalar = requires(T a, T b) {
  T(0.0);
  a + b;
  a - b;
  a* b;
  a / b;
  -a;
  a >= b;
};

/// Result of a comparison of two scalars: bool, or one bool per lane of a batch.
template <class T>
using Mask = std::decay_t<decltype(std::declval<T>() >= std::declval<T>())>;

/// a where the mask holds, b elsewhere; batches bring their own overload.
template <class T>
constexpr const T& select(bool mask, const T& a, const T& b) {
  return mask ? a : b;
}

/// Sine and cosine of one angle, in this order.
template <class T>
using SinePair = std::pair<T, T>;

/// A scalar's way to compute sine and cosine together; batches specialise it.
template <class T>
struct SineCosine {
  /// Of an angle in rad.
  static SinePair<T> of(const T& angle) {
    using std::cos;
    using std::sin;
    return {sin(angle), cos(angle)};
  }
};

/// Sine and cosine of one angle, rad.
template <class T>
SinePair<T> sin_cos(const T& angle) {
  return SineCosine<T>::of(angle);
}

}  // namespace risley
