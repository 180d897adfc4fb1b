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

/// The calibration whose accuracy is to be predicted, and the number of shots for it.
struct FlightForecastOptions {
  /// The calibration that will be made: priors are those of its sensor and mount, which take the
  /// place of the planned flight's, and its errors are those of the trajectory.
  FlightCalibrationOptions calibration;
  double rate =
      5000;  ///< shots per second that it will be made of, or the sensor's if that is less
};

/// How far points of a strip are off by what they share with others; the noise of the ranges and
/// what the trajectory's errors do from sample to sample come on top. RMS over places of the ground
/// that several strips see; east, north, up, m.
struct SharedPointErrors {
  Eigen::Vector3d trajectory{0, 0, 0};  ///< before: with the trajectory's errors alone
  Eigen::Vector3d adjusted{0, 0, 0};    ///< after the calibration, of all that it adjusts
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
  std::size_t used = 0;                    ///< of these: on ground that several strips see
  std::size_t cells = 0, rough_cells = 0;
  double cell_size = 0;     ///< m
  double knot_spacing = 0;  ///< s
  double rate = 0;          ///< shots per second
  SharedPointErrors points;
};

/// Makes the calibration's last equations for a flight that is planned and judges them as those of
/// one that was flown: shots with the ranges' noise on the terrain, planes found from them,
/// corrections of the trajectory between knots. What errors of the start values, trees and moving
/// things do on top is not in it. docs/theory/flight.md
/// @throws EstimationError when fewer than two strips overlap or no ground is found;
///         InvalidArgument as flown(), for_each_planned_piece() and calibrate_flight(); Cancelled
FlightForecast forecast(const PlannedFlight& planned, const FlightForecastOptions& options,
                        const Progress& progress = {});

}  // namespace risley::calibration
