// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "risley/estimation/angle_noise.hpp"
#include "risley/estimation/batch_map.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/estimation/normal_equations.hpp"

namespace risley::estimation {

/// The weights with which the estimate used its shots.
inline ShotWeights weights_of(const Estimate& estimate) {
  ShotWeights weights;
  weights.angle_noise = usable_noise(estimate.noise.value);
  weights.cut = BatchMapOptions{}.outlier_chi2 * std::max(1.0, estimate.unit_variance);
  return weights;
}

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
