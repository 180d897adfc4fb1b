// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Whether what a recording holds can have come from a lidar in its own frame, before anybody asks
// which one it was.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace risley::recordings {

/// Fewer shots fill no field of view.
inline constexpr std::size_t kFewestJudged = 1000;
/// No lidar of this kind sees farther, m.
inline constexpr double kFarthestReach = 1000.0;

/// Directions and how far they reach about their mean.
struct DirectionSpread {
  double radius = 0;  ///< of the cone about the mean that holds 99 % of them, rad
  double azimuth_from = 0, azimuth_to = 0;  ///< of the arc that holds them all, to above from, rad
  double zenith_from = 0, zenith_to = 0;    ///< without the outer 0.5 % on either side, rad
};

/// DirectionSpread::radius alone, which takes a third of the time.
double cone_radius(std::span<const double> azimuth, std::span<const double> zenith);
/// @param azimuth, zenith  rad, not empty
DirectionSpread direction_spread(std::span<const double> azimuth, std::span<const double> zenith);

/// What is wrong with directions that no scan fills, in words: map coordinates, angles in another
/// unit. Nothing where there are too few to judge: map coordinates take 20, others kFewestJudged.
/// @param range  m, of the same shots; empty or NaN where they have none
std::optional<std::string> not_a_scan(std::span<const double> azimuth,
                                      std::span<const double> zenith,
                                      std::span<const double> range);
/// The same where the cone_radius() of so many directions is known.
std::optional<std::string> not_a_scan(double radius, std::size_t directions,
                                      std::span<const double> range);

/// What is wrong with ranges beyond a sensor's reach, in words with the unit that they are likely
/// in. Nothing where nearly all are within.
/// @param range  m, of shots with a return
/// @param reach  of the sensor, m
/// @param whose  "this sensor", or of which sensors it is the reach
std::optional<std::string> beyond_reach(std::span<const double> range, double reach,
                                        const std::string& whose);

}  // namespace risley::recordings
