// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <numbers>

namespace risley {

/// Half a turn, rad.
inline constexpr double kPi = std::numbers::pi;
/// A whole turn, rad.
inline constexpr double kTwoPi = 2.0 * std::numbers::pi;
/// Factor from degrees to radians.
inline constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;
/// Factor from radians to degrees.
inline constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;

/// Degrees exist only at the edges (files, command line, plots).
constexpr double radians_from_degrees(double degrees) { return degrees * kRadiansPerDegree; }
/// Solid angle, sr.
inline constexpr double kSquareDegree = kRadiansPerDegree * kRadiansPerDegree;

/// As radians_from_degrees(), the other way.
constexpr double degrees_from_radians(double radians) { return radians * kDegreesPerRadian; }

/// The same angle in [-pi, pi]; NaN for a non-finite angle.
inline double wrap_to_pi(double angle) { return std::remainder(angle, kTwoPi); }

/// The same angle in [0, 2 pi); NaN for a non-finite angle.
inline double wrap_to_two_pi(double angle) {
  const double remainder = std::remainder(angle, kTwoPi);
  const double wrapped = remainder < 0.0 ? remainder + kTwoPi : remainder;
  return wrapped >= kTwoPi ? 0.0 : wrapped;
}

}  // namespace risley
