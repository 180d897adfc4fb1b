// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/flight_calibration.hpp"
#include "risley/calibration/planned_shots.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"

namespace risley::calibration {

/// The calibration to be predicted, and the number of shots for it.
struct FlightForecastOptions {
  /// The calibration that will be made: priors are those of its sensor and mount, which take the
  /// place of the planned flight's, and its errors are those of the trajectory.
  FlightCalibrationOptions calibration;
  double rate = 5000;  ///< shots per second of the calibration, or the sensor's if that is less
};

/// Common errors of the points of a strip; the noise of the ranges and the trajectory's errors from
/// sample to sample are extra. RMS over places of the ground covered by several strips; east,
/// north, up, m.
struct SharedPointErrors {
  Eigen::Vector3d trajectory{0, 0, 0};  ///< before: with the trajectory's errors only
  Eigen::Vector3d adjusted{0, 0, 0};    ///< after the calibration, of all adjusted quantities
  /// Of two strips at one place, the second less the first.
  Eigen::Vector3d strips_trajectory{0, 0, 0}, strips_adjusted{0, 0, 0};
  std::size_t places = 0, pairs = 0;
};

/// What a flight will determine.
struct FlightForecast : FlightJudgement {
  std::vector<Warning> warnings;
  std::vector<trajectories::StripTimes> strips;
  std::vector<std::uint64_t> strip_shots;  ///< used, that end on the terrain
  std::uint64_t fired = 0, shots = 0;      ///< of all strips: fired, and ending on the terrain
  std::size_t used = 0;                    ///< of these: on ground covered by several strips
  std::size_t cells = 0, rough_cells = 0;
  double cell_size = 0;     ///< m
  double knot_spacing = 0;  ///< s
  double rate = 0;          ///< shots per second
  SharedPointErrors points;
};

/// Forms the calibration's last equations for a planned flight and judges them like those of a real
/// one: shots with the ranges' noise on the terrain, planes found from them, corrections of the
/// trajectory between knots. Additional effects of wrong start values, trees and moving things are
/// not included. docs/theory/flight.md
/// @throws EstimationError when fewer than two strips overlap or no ground is found;
///         InvalidArgument as flown(), for_each_planned_piece() and calibrate_flight(); Cancelled
FlightForecast forecast(const PlannedFlight& planned, const FlightForecastOptions& options,
                        const Progress& progress = {});

}  // namespace risley::calibration
