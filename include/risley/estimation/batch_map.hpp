// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/estimation/angle_noise.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/estimation/rotor_trajectory.hpp"
#include "risley/estimation/solution.hpp"

namespace risley::estimation {

/// Settings of the batch estimator.
struct BatchMapOptions {
  std::optional<AngleNoise> angle_noise;  ///< held; empty: estimated, one variance for each angle
  std::vector<FreeParameter> free;        ///< constants to estimate; may be empty
  /// 1 sigma of a possible turn of the series' frame relative to the sensor's about both axes
  /// across the beam, rad; 0: none
  double frame_sigma = 0;
  /// Motion model of the rotors [prisms]; empty chooses it by maximum likelihood.
  std::vector<RotorProcess> rotor_process;
  double knot_interval = kKnotInterval;  ///< s
  /// Shots with more chi2 (2 degrees of freedom) than this are outliers: 1 good one in 22,000.
  double outlier_chi2 = 20.0;
  int most_iterations = 40;  ///< of the coarse pass
};

/// Maximum a posteriori estimate of the constant parameters and of the rotors' motion from all
/// shots at once: Gauss-Newton over the whole trajectory with parameters that have no process
/// noise, first on shots thinned to 1 kHz with weights robust against gross errors, then on all of
/// them, which takes one or two more steps. At the end a hard threshold decides on outliers, and
/// the covariance accounts for the autocorrelation and the scatter of the residuals. [B21 section
/// 2.4 states the model; the method departs from it: docs/theory/map.md]
/// @param series  ready for use: prepare_shots()
/// @param start   of the first stretch
/// @throws EstimationError when there are no data for an estimate; InvalidArgument
Solution run_batch_map(const PackedSeries& series, const Start& start,
                       const sensors::Sensor& sensor, const BatchMapOptions& options,
                       const Progress& progress = {});

}  // namespace risley::estimation
