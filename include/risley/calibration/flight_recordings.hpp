// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "risley/calibration/flight_shots.hpp"
#include "risley/calibration/plane_points.hpp"
#include "risley/sensors/sensor.hpp"
#include "risley/trajectories/flown_strips.hpp"

namespace risley::calibration {

/// The recordings of one flight, prepared for a calibration.
struct FlightRecordings {
  FlightShots shots;
  /// The given sensor with the parameters, determined from the recordings, that it uses to compute
  /// its directions, and their accuracy. One with a covariance, as a calibration writes it, keeps
  /// its own parameters.
  sensors::Sensor sensor;
  PrismTrain believed;  ///< used to compute the recordings' directions
  /// Shift of each recording's rotation angles due to the common estimate of the believed
  /// parameters [recordings][prisms], rad.
  std::vector<std::vector<double>> angle_shift;
  double rotation_angle_sigma = 0;      ///< independent noise of a rotation angle, RMS, rad
  std::size_t outside_strips = 0;       ///< shots between the strips, dropped
  std::vector<std::size_t> strip_rows;  ///< shots of every given strip [strips]
};

/// Puts the shots of all recordings that fall into strips into the order of time.
/// @param recordings  of one sensor; none may begin before the one before it has ended, whatever
///                    the order they are given in
/// @param strips      in the order of time
/// @param shift_ns  offset added to the recordings' times to get those of the strips
/// @throws InvalidArgument for no recordings, recordings of different sensors or of the same time;
///         EstimationError when their parameters disagree or no shot is in a strip
FlightRecordings flight_recordings(const std::vector<RangedRecording>& recordings,
                                   const sensors::Sensor& given,
                                   const std::vector<trajectories::FlownStrip>& strips,
                                   std::int64_t shift_ns);

}  // namespace risley::calibration
