// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/ekf.hpp"

namespace risley::estimation {

/// What the user asks for.
struct EstimateOptions {
  sensors::Sensor sensor;               ///< start values; its combination is read off the data
  std::optional<double> angle_noise;    ///< rad, default the sensor's
  std::vector<std::string> fixed;       ///< default free parameters to hold at the sensor's value
  std::vector<std::string> additional;  ///< further parameters to free
  std::vector<RotorProcess> rotor_process;  ///< empty: maximum likelihood
  std::optional<bool> mirrored;             ///< the elevation's sign is turned; empty: find out
};

/// One estimated quantity, SI units.
struct EstimatedValue {
  std::string name;
  double value = 0;
  double sigma = 0;
};

/// Everything one estimation found.
struct Estimate {
  std::string method;  ///< "ekf"
  bool converged = false;
  std::string reason;                 ///< why not converged; empty when converged
  std::vector<std::string> warnings;  ///< what the user should know all the same
  sensors::Sensor sensor;             ///< the calibrated sensor with its covariance
  bool mirrored = false;
  std::vector<EstimatedValue> values;  ///< parameters, mean speeds, first rotation angles
  EkfResult filter;
  Start start;
  Moments azimuth_residuals, zenith_residuals;  ///< rad, outliers left out
  double angle_noise = 0;                       ///< assumed, rad, before rounding
  double expected_residual = 0;                 ///< rms of noise and rounding together, rad
};

/// Estimates parameters and rotation angles with the paper's filter. A mirrored recording is turned
/// first; results describe the turned one.
/// @param recorded_series  shots to use, as recorded
/// @param recorded_head    all shots of the first second, as recorded, for the start
/// @throws EstimationError when the data cannot answer, InvalidArgument for unknown parameters
Estimate estimate_with_ekf(const AngleSeries& recorded_series, const AngleSeries& recorded_head,
                           const EstimateOptions& options, const Progress& progress = {});

}  // namespace risley::estimation
