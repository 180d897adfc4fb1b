// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/estimation/evaluation.hpp"
#include "risley/estimation/piecewise.hpp"
#include "risley/estimation/residual_maps.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// Angular velocity of one rotor at an estimate's states.
struct RotorSpeed {
  double mean = 0;              ///< rad/s, outliers left out
  std::vector<double> change;   ///< [states], less the mean, rad/s; rounding beside the mean is 0
  estimation::Moments moments;  ///< of the change, without outliers
};

/// Mean residuals over a plane of two angles, and its noteworthy cells.
struct ResidualPlane {
  estimation::ResidualMap map;
  /// Cells with fewer shots than this are ignored as unreliable.
  double fewest_shots = 0;
  /// Expected mean in a typical cell for pure noise, rad.
  double azimuth_noise = 0, zenith_noise = 0;
};

/// The same over the rotation angles of two prisms.
struct PrismPairResiduals {
  int prism_x = 0, prism_y = 0;
  ResidualPlane residuals;
};

/// Shots per cell of the field of view.                                            [B21 Fig. 2b]
struct ShotDensity {
  double duration = 0;         ///< of the counted beginning, s
  double cell = 0;             ///< side, rad
  std::vector<double> x, y;    ///< azimuth and zenith of the cells' middles, rad
  std::vector<double> shots;   ///< [cells]
  std::size_t total = 0;       ///< of all cells
  double mean_per_cell = 1.0;  ///< over the cells with shots
};

/// Details of an estimate beyond its numbers.
struct EstimateDetails {
  /// What the recording can determine, as sentences; empty for the filter and after a failure.
  std::vector<std::string> advice;
  std::optional<estimation::PiecewiseEstimate> pieces;     ///< under the same condition
  std::vector<RotorSpeed> speeds;                          ///< [prisms]
  std::vector<estimation::Moments> rotation_angle_errors;  ///< [prisms], rad; without truth none
  ResidualPlane residuals_over_field;
  std::vector<PrismPairResiduals> residuals_over_angles;  ///< every pair of prisms
  ShotDensity density;
};

/// @param nominal  the starting values of the estimation
/// @param head        every shot of the beginning, as recorded
/// @param evaluation  if the truth is known
/// @throws Cancelled
EstimateDetails estimate_details(const estimation::Estimate& estimate,
                                 const sensors::Sensor& nominal,
                                 const estimation::AngleSeries& head,
                                 const std::optional<estimation::Evaluation>& evaluation = {},
                                 const Progress& progress = {});

}  // namespace risley::jobs
