// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/core/require.hpp"

namespace risley {

/// Minimum of a function of one variable that has a single minimum in [a, b], by golden-section
/// search: each step costs one evaluation and leaves 0.618 of the interval.
/// @param tolerance  width of the interval at which the search ends, > 0
/// @throws InvalidArgument for a non-finite end, b below a, and a tolerance not above 0
template <class Function>
double golden_section_minimum(Function&& f, double a, double b, double tolerance) {
  require_finite("a", a);
  require_not_below("b", b, a);
  require_above("tolerance", tolerance, 0);
  constexpr double kShare = 0.6180339887498949;  // (sqrt(5) - 1) / 2
  double left = b - kShare * (b - a), right = a + kShare * (b - a);
  double at_left = f(left), at_right = f(right);
  while (b - a > tolerance) {
    if (at_left < at_right) {
      b = right;
      right = left;
      at_right = at_left;
      left = b - kShare * (b - a);
      at_left = f(left);
    } else {
      a = left;
      left = right;
      at_left = at_right;
      right = a + kShare * (b - a);
      at_right = f(right);
    }
  }
  return 0.5 * (a + b);
}

}  // namespace risley
