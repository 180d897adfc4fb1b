// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>

#include "risley/estimation/estimate.hpp"

namespace risley::estimation {

/// Calls visit(angle, azimuth_residual, zenith_residual) for every shot that the estimate used;
/// angle(k) is the rotation angle of prism k there, rad, any number of turns.
template <class Visit>
void for_each_used_shot(const Estimate& estimate, const Visit& visit) {
  const RotorTrajectory& t = estimate.trajectory;
  for (std::size_t knot = 0; knot < t.size(); ++knot) {
    for (std::size_t i = t.first_shot[knot]; i < t.last_shot[knot]; ++i) {
      if (estimate.outlier[i] != 0 || !std::isfinite(estimate.azimuth_residual[i])) continue;
      const double seconds =
          1e-9 * static_cast<double>(estimate.series.time_ns[i] - t.time_ns[knot]);
      visit([&](std::size_t k) { return t.angle(knot, k, seconds); }, estimate.azimuth_residual[i],
            estimate.zenith_residual[i]);
    }
  }
}

}  // namespace risley::estimation
