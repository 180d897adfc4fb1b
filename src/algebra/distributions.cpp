// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/algebra/distributions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>
#include <unsupported/Eigen/SpecialFunctions>

namespace risley::algebra {
namespace {

/// From here on the series of the exact quantile grows long.
constexpr double kManyDegrees = 1000;

/// Where a function that falls from 0 on reaches a value, to the last digit.
template <class Function>
double where_falls_to(const Function& falling, double value) {
  double low = 0, high = 1;
  while (falling(high) > value) high *= 2;
  for (double middle = 0.5 * (low + high); low < middle && middle < high;
       middle = 0.5 * (low + high)) {
    (falling(middle) > value ? low : high) = middle;
  }
  return high;
}

}  // namespace

double normal_tail(double z) { return 0.5 * std::erfc(z / std::sqrt(2.0)); }

double two_sided_normal_quantile(double probability) {
  if (!(probability > 0)) return std::numeric_limits<double>::infinity();
  return where_falls_to([](double z) { return 2 * normal_tail(z); }, probability);
}

double chi_square_tail(double chi2, double degrees) {
  return Eigen::numext::igammac(0.5 * degrees, 0.5 * std::max(chi2, 0.0));
}

double chi_square_per_degree(double degrees, double normal_quantile) {
  if (!(degrees > 0)) return std::numeric_limits<double>::quiet_NaN();
  if (degrees > kManyDegrees) {
    const double ninth = 2.0 / (9.0 * degrees);
    return std::pow(1.0 - ninth + normal_quantile * std::sqrt(ninth), 3);
  }
  return where_falls_to([&](double value) { return chi_square_tail(degrees * value, degrees); },
                        normal_tail(normal_quantile));
}

double f_tail(double chi2, double degrees, double factor_degrees) {
  return Eigen::numext::betainc(0.5 * factor_degrees, 0.5 * degrees,
                                factor_degrees / (factor_degrees + chi2));
}

double two_sided_student_tail(double t, double degrees) {
  if (t == 0) return 1;
  if (!std::isfinite(t * t)) return 0;
  return f_tail(t * t, 1, degrees);
}

}  // namespace risley::algebra
