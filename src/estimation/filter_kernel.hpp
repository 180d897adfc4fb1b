// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "risley/core/instruction_set.hpp"
#include "risley/estimation/rotor_process.hpp"

#include "estimation/kernel_arguments.hpp"

namespace risley::estimation {

/// One run of the filter through some shots of a series.
struct FilterRun {
  std::size_t first = 0, count = 0;
  bool backwards = false;  ///< from the first shot to the one before it, and so on
  /// Observations of a larger chi-square are rejected, as are those whose modelled beam does not
  /// get through.
  double gate = 0;
  const unsigned char* outlier = nullptr;  ///< [shots of the series], excluded observations
  unsigned char* refused = nullptr;        ///< [shots of the series], set for outliers; or nullptr

  /// Of the innovations, [count] or nullptr: chi-square and determinant of the covariance, rad^4.
  /// For unused observations they are 0 and 1.
  double* chi_square = nullptr;
  double* determinant = nullptr;
  /// Mean and covariance at every shot [count][states (1 + states)], or nullptr.
  double* kept = nullptr;
  bool keep_predicted = false;  ///< before the shot's own observation
};

/// Plain arguments of one call. States are the free parameters, then angle and speed of each rotor.
struct FilterArguments : TrainArguments, ShotArguments {
  const RotorProcess* process = nullptr;  ///< [prisms]
  double noise_variance = 0;              ///< of both angles without rounding, rad^2
  double walk_variance = 0;               ///< of every free parameter, per second

  /// Linearisation point of the model; nullptr: the filter's own state.
  const double* reference_parameters = nullptr;  ///< [free]
  const double* reference_angle = nullptr;       ///< [shots][prisms]

  FilterRun run;
  double* mean = nullptr;                 ///< [states], changed
  double* covariance = nullptr;           ///< [states][states], changed
  std::int64_t* state_time_ns = nullptr;  ///< if the state is stored, changed
};

/// @return number of processed shots: all, unless the mean ceased to be finite
RISLEY_DECLARE_KERNEL(std::size_t run_filter(const FilterArguments& arguments))

}  // namespace risley::estimation
