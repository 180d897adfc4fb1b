// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "risley/calibration/flight_calibration.hpp"
#include "risley/core/progress.hpp"

namespace risley::jobs {

/// One strip as flown. Of the trajectory as given.
struct FlightStrip {
  std::uint16_t strip = 0;          ///< from 0
  std::size_t shots = 0;            ///< of the sample
  double begin = 0, duration = 0;   ///< s since the first shot of the flight; s
  double course = 0;                ///< from its first to its last place, clockwise from north, rad
  double speed = 0;                 ///< between these, m/s
  double range = 0;                 ///< median, m: about the height above the ground
  double sway = 0;                  ///< of roll and pitch about their means, together, RMS, rad
  std::vector<double> east, north;  ///< of places along it, tangent frame, m
};

/// Differences of two strips on the same ground, over squares of it, as columns of one length: the
/// second less the first, along the normals, m. NaN if they cannot be compared.
struct StripDifferences {
  std::uint16_t first = 0, second = 0;
  std::vector<double> east, north;    ///< middles of the squares, tangent frame, m
  std::vector<double> before, after;  ///< m
};

/// The ground covered by several strips, over squares of it, as columns of one length. NaN:
/// unknown.
struct FlightGround {
  std::vector<double> east, north;    ///< middles of the squares, tangent frame, m
  std::vector<double> before, after;  ///< differences of all pairs of strips, RMS, m
  std::vector<double> roughness;      ///< scatter of the points about their planes, 1 sigma, m
  std::vector<double> slope;          ///< of the planes, rad
  std::vector<double> strips;         ///< most that saw one plane
};

/// Data for drawing a calibration in flight, in addition to its numbers. Its size is bounded for
/// any flight.
struct FlightDetails {
  std::size_t shots = 0;                ///< of the random sample behind all of it
  double plane_size = 0;                ///< side of the cells with a plane each, m
  double square_size = 0;               ///< side of the squares, each of several cells, m
  std::size_t strip_count = 0;          ///< of the flight
  std::vector<FlightStrip> strips;      ///< the first ones of many
  std::size_t pair_count = 0;           ///< of strips over the same ground
  std::vector<StripDifferences> pairs;  ///< those with the most ground in common
  FlightGround ground;
};

/// How large a FlightDetails may become.
struct FlightDetailsOptions {
  std::size_t most_shots = 1'000'000;  ///< of the sample
  std::size_t most_squares = 2000;     ///< of a picture
};

/// Agreement of the strips with the given and with the adjusted values.
/// @param shots, trajectory, options  the arguments of calibrate_flight()
/// @param found                       what it gave
/// @throws InvalidArgument for a calibration of other shots, bounds below 1000 shots or 1 square,
/// and as poses_of(); Cancelled
FlightDetails flight_details(const calibration::FlightShots& shots,
                             const trajectories::Trajectory& trajectory,
                             const calibration::FlightCalibrationOptions& options,
                             const calibration::FlightCalibration& found,
                             const FlightDetailsOptions& bounds = {},
                             const Progress& progress = {});

}  // namespace risley::jobs
