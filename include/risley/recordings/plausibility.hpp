// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Whether the contents of a recording can come from a lidar in its own frame, checked before
// choosing the sensor.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace risley::recordings {

/// Fewer shots do not fill a field of view.
inline constexpr std::size_t kFewestJudged = 1000;
/// Greatest range of any lidar of this kind, m.
inline constexpr double kFarthestReach = 1000.0;

/// Directions and their spread about their mean.
struct DirectionSpread {
  double radius = 0;                        ///< of the cone about the mean with 99 % of them, rad
  double azimuth_from = 0, azimuth_to = 0;  ///< of the arc that contains them all, to above from,
                                            ///< rad
  double zenith_from = 0, zenith_to = 0;    ///< without the outer 0.5 % on either side, rad
};

/// DirectionSpread::radius alone, which takes a third of the time.
double cone_radius(std::span<const double> azimuth, std::span<const double> zenith);
/// @param azimuth, zenith  rad, not empty
DirectionSpread direction_spread(std::span<const double> azimuth, std::span<const double> zenith);

/// Defect of directions that no scan could produce, in words: map coordinates, angles in another
/// unit. Nothing if there are too few to judge: map coordinates take 20, others kFewestJudged.
/// @param range  m, of the same shots; empty or NaN if they have none
std::optional<std::string> not_a_scan(std::span<const double> azimuth,
                                      std::span<const double> zenith,
                                      std::span<const double> range);
/// The same with the known cone_radius() of that many directions.
std::optional<std::string> not_a_scan(double radius, std::size_t directions,
                                      std::span<const double> range);

/// Defect of ranges beyond a sensor's reach, in words with their likely unit. Nothing if nearly all
/// are within.
/// @param range  m, of shots with a return
/// @param reach  of the sensor, m
/// @param whose  "this sensor", or the sensors with this reach
std::optional<std::string> beyond_reach(std::span<const double> range, double reach,
                                        const std::string& whose);

}  // namespace risley::recordings
