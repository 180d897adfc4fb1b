// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>

namespace risley::identification {

/// Highest degree of a curve.
inline constexpr int kMaxCurveDegree = 4;

/// Weight of each coefficient of a segment at a time, and its derivative, 1/s. Times slightly
/// outside of the segment follow its polynomial.
struct CurveWeights {
  std::array<double, kMaxCurveDegree + 1> value{}, rate{};
};

/// Rotation angles of all rotors over a stretch of time, cut into segments of equal length. A
/// smooth curve is a uniform B-spline (one segment of degree 1: constant speed), any other has a
/// separate polynomial in every segment, so that angles may jump where a recording lost shots.
struct RotorCurves {
  double begin = 0, end = 0;  ///< s
  int segments = 1, degree = 1;
  bool smooth = true;
  Eigen::MatrixXd coefficient;  ///< [prisms, coefficients()], rad

  RotorCurves() = default;
  /// All coefficients zero.
  RotorCurves(int prisms, double begin, double end, int segments, int degree, bool smooth);

  /// Number of coefficients of one rotor.
  int coefficients() const { return smooth ? segments + degree : segments * (degree + 1); }
  double segment_length() const { return (end - begin) / segments; }  ///< s
  /// The segment of that time, the first or last one beyond the ends.
  int segment_of(double time) const;
  /// The first of the degree + 1 coefficients that act in a segment.
  int first_coefficient(int segment) const { return smooth ? segment : segment * (degree + 1); }
  /// rad, not wrapped
  double angle(int rotor, double time) const { return weighted(rotor, time, &CurveWeights::value); }
  /// rad/s
  double angular_velocity(int rotor, double time) const {
    return weighted(rotor, time, &CurveWeights::rate);
  }
  double mean_angular_velocity(int rotor) const;  ///< from begin to end, rad/s

 private:
  using Weights = std::array<double, kMaxCurveDegree + 1>;
  double weighted(int rotor, double time, Weights CurveWeights::*weights) const;
};

/// The weights of a segment's coefficients. @param time  s
CurveWeights curve_weights(const RotorCurves& curves, int segment, double time);

/// The curves of that shape nearest to others, by least squares at many times.
RotorCurves resampled(const RotorCurves& curves, RotorCurves shape);

}  // namespace risley::identification
