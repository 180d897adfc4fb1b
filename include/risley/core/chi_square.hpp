// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

namespace risley {

/// Quantile of chi-square over its degrees of freedom at the probability of `normal_quantile`
/// standard deviations of a normal distribution, by Wilson and Hilferty (1931): to 1e-6 from a
/// thousand degrees on.
inline double chi_square_per_degree(double degrees, double normal_quantile) {
  const double ninth = 2.0 / (9.0 * degrees);
  return std::pow(std::max(0.0, 1.0 - ninth + normal_quantile * std::sqrt(ninth)), 3);
}

}  // namespace risley
