// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "risley/estimation/angle_noise.hpp"
#include "risley/estimation/batch_map.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/parallel/in_order.hpp"

namespace risley::estimation {

/// The weights with which the estimate used its shots.
inline ShotWeights weights_of(const Estimate& estimate) {
  ShotWeights weights;
  weights.angle_noise = usable_noise(estimate.noise.value);
  weights.cut = BatchMapOptions{}.outlier_chi2 * std::max(1.0, estimate.unit_variance);
  return weights;
}

/// Shots of a series, and their directions according to a solution.
struct SolvedShots {
  AngleSeries shots;
  std::vector<std::vector<double>> rotation_angle;  ///< [prisms], rad, of any number of turns
  ShotResiduals residuals;                          ///< these and the angles: NaN: not used
  std::span<const unsigned char> outlier;

  bool used(std::size_t i) const { return outlier[i] == 0 && std::isfinite(residuals.azimuth[i]); }
};

SolvedShots solved_shots(const Solution& solution, const PackedSeries& series, ShotRange shots);

/// Calls make(solved) with the shots of an estimate, some at a time and from several threads, and
/// take(result) with the returned value, in the order of the shots.
template <class Make, class Take>
void for_all_shots(const Estimate& estimate, const Make& make, const Take& take) {
  constexpr std::size_t kShots = 1 << 16;
  const std::size_t all = estimate.series.size();
  parallel::in_order((all + kShots - 1) / kShots,
                     [&](std::size_t i) {
                       return make(solved_shots(estimate, estimate.series,
                                                {i * kShots, std::min((i + 1) * kShots, all)}));
                     },
                     take);
}

}  // namespace risley::estimation
