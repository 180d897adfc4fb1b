// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/estimation/solution.hpp"

namespace risley::estimation {

/// Settings of the extended Kalman filter.
struct EkfOptions {
  double angle_noise = 0;           ///< 1 sigma of azimuth and zenith before rounding, rad
  std::vector<FreeParameter> free;  ///< constants to estimate
  /// Noise of the rotors [prisms]; empty chooses it by maximum likelihood of the innovations after
  /// the first pass (which takes two passes or more). The filter's rotors have no jerk.
  std::vector<RotorProcess> rotor_process;
  double parameter_walk = 0;  ///< random walk of every free angle, rad / sqrt(s)
  /// Innovations with a chi-square (2 degrees of freedom) above this are outliers, after the first
  /// gate_after updates; before, the gate is 400.
  double gate_chi_square = 13.816;  // one good shot in a thousand
  std::size_t gate_after = 50;
  /// Passes over the data; each starts from the previous one's result at the first shot, so that
  /// everything is linearised near the solution.
  int passes = 2;
};

/// Forward filter, backward filter, and their combination weighted by inverse covariance, with the
/// free parameters, and angle and speed of every rotor as states.        [B21 section 2.4]
/// Departures from the paper: constants have no process noise unless asked for; the backward filter
/// starts from a wide prior at the forward filter's last state, so no observation counts twice;
/// process noise is continuous and found by maximum likelihood. docs/theory/ekf.md
/// Parameters and their covariance are means over the smoothed ones; the trajectory has a knot for
/// every shot, without acceleration. Data and prior are not separated, nor common errors of the
/// angles. Memory is that of the result: filtered covariances are kept for one block of shots at a
/// time.
/// @throws EstimationError when the series is empty or the filter diverges (the message gives the
/// place)
Solution run_ekf(const AngleSeries& series, const Start& start, const EkfOptions& options,
                 const Progress& progress = {});

}  // namespace risley::estimation
