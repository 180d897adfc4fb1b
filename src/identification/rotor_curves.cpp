// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/identification/rotor_curves.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/require.hpp"

namespace risley::identification {

RotorCurves::RotorCurves(int prisms, double begin_, double end_, int segments_, int degree_,
                         bool smooth_)
    : begin(begin_), end(end_), segments(segments_), degree(degree_), smooth(smooth_) {
  require_above("end", end, begin, "s");
  require_at_least("segments", segments, 1);
  require_between("degree", degree, 0, kMaxCurveDegree);
  coefficient = Eigen::MatrixXd::Zero(prisms, coefficients());
}

int RotorCurves::segment_of(double time) const {
  const double segment = std::floor((time - begin) / segment_length());
  return static_cast<int>(std::clamp(segment, 0.0, static_cast<double>(segments - 1)));
}

double RotorCurves::weighted(int rotor, double time, Weights CurveWeights::*weights) const {
  const int segment = segment_of(time), first = first_coefficient(segment);
  const CurveWeights all = curve_weights(*this, segment, time);
  double sum = 0;
  for (int m = 0; m <= degree; ++m) {
    sum += (all.*weights)[static_cast<std::size_t>(m)] * coefficient(rotor, first + m);
  }
  return sum;
}

double RotorCurves::mean_angular_velocity(int rotor) const {
  return (angle(rotor, end) - angle(rotor, begin)) / (end - begin);
}

CurveWeights curve_weights(const RotorCurves& curves, int segment, double time) {
  CurveWeights weights;
  const double length = curves.segment_length();
  const double u = (time - curves.begin) / length - segment;
  if (!curves.smooth) {  // powers of a variable that runs from -1 to 1
    const double tau = 2 * u - 1;
    double power = 1;
    for (int m = 0; m <= curves.degree; ++m) {
      const auto at = static_cast<std::size_t>(m);
      weights.value[at] = power;
      power *= tau;
      if (m > 0) weights.rate[at] = m * weights.value[at - 1] * 2 / length;
    }
    return weights;
  }
  // De Boor's recursion on uniform knots; the rate comes from the degree below.
  auto& value = weights.value;
  value[0] = 1;
  for (int d = 1; d <= curves.degree; ++d) {
    const auto below = value;
    for (int m = 0; m <= d; ++m) {
      const double left = m > 0 ? below[static_cast<std::size_t>(m - 1)] : 0.0;
      const double right = m < d ? below[static_cast<std::size_t>(m)] : 0.0;
      value[static_cast<std::size_t>(m)] = ((u + d - m) * left + (m + 1 - u) * right) / d;
      if (d == curves.degree) weights.rate[static_cast<std::size_t>(m)] = (left - right) / length;
    }
  }
  return weights;
}

RotorCurves resampled(const RotorCurves& curves, RotorCurves shape) {
  const int prisms = static_cast<int>(curves.coefficient.rows());
  const int samples = 4 * (shape.degree + 1) * shape.segments;
  const Eigen::Index count = shape.coefficients();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(count, prisms);
  for (int i = 0; i < samples; ++i) {
    const double time = shape.begin + (shape.end - shape.begin) * (i + 0.5) / samples;
    const int segment = shape.segment_of(time), first = shape.first_coefficient(segment);
    const CurveWeights weights = curve_weights(shape, segment, time);
    for (int a = 0; a <= shape.degree; ++a) {
      const double weight = weights.value[static_cast<std::size_t>(a)];
      for (int b = 0; b <= shape.degree; ++b) {
        normal(first + a, first + b) += weight * weights.value[static_cast<std::size_t>(b)];
      }
      for (int k = 0; k < prisms; ++k) right(first + a, k) += weight * curves.angle(k, time);
    }
  }
  shape.coefficient = algebra::SymmetricSolver(normal, 1e-12).solve_columns(right).transpose();
  return shape;
}

}  // namespace risley::identification
