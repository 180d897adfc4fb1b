// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// Estimates from short pieces of a recording, in addition to that of the whole: they show whether
/// parameters drift, and whether sigmas are correct even without a truth.
struct PiecewiseEstimate {
  std::vector<double> time;                ///< [pieces], middle, s since the first shot
  double duration = 0;                     ///< of the longest piece, s
  std::vector<std::vector<double>> value;  ///< [free][pieces], SI units
  std::vector<std::vector<double>> sigma;  ///< [free][pieces]
  std::size_t failed = 0;                  ///< pieces that gave no estimate; they have no row
  /// Squared differences from their weighted mean over the pieces' own variances, per degree of
  /// freedom: 1 for constant parameters and correct sigmas. NaN below two pieces.
  double chi2 = 0;
  double degrees_of_freedom = 0;

  std::size_t size() const { return time.size(); }
};

/// Cuts the recording into pieces of equal length and estimates each by the batch estimator with
/// the rotors' motion model of the whole. At most the first 100,000 shots of a piece are used, so
/// that long recordings take no longer. Only for estimates of the batch estimator.
/// @param sensor  the starting values of the estimation
/// @throws InvalidArgument for less than one piece, or an estimate of the filter
PiecewiseEstimate estimate_piecewise(const Estimate& estimate, const sensors::Sensor& sensor,
                                     std::size_t pieces, const Progress& progress = {});

}  // namespace risley::estimation
