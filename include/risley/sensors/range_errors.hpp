// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace risley::sensors {

/// Systematic errors of ranges in addition to the constant one, which is Sensor::range_offset:
/// reported less true range is
///
///   range_offset + near exp((1 m - range) / kNearDecay) + incidence footprint_depth
///     + per_decade log10(kWalkIntensity / intensity) + emitter[beam]
///
/// The simulator adds them and a calibration on walls estimates them.
struct RangeErrors {
  double near = 0;              ///< at 1 m, m; falls by e with every kNearDecay
  double incidence = 0;         ///< part of the footprint's depth, see footprint_depth(), 1
  double per_decade = 0;        ///< increase per tenth of the intensity, m
  std::vector<double> emitter;  ///< m [emitters]; empty: all 0

  friend bool operator==(const RangeErrors&, const RangeErrors&) = default;
};

/// Range over which the error near the sensor falls by e, m.
inline constexpr double kNearDecay = 2.0;
/// Intensity at which the walk error is 0: a diffuse surface of two thirds on the sensor's scale,
/// where 150 stands for 100 %.
inline constexpr double kWalkIntensity = 100.0;

/// d range / d RangeErrors::near: 1 at 1 m. @param range  m
inline double near_share(double range) { return std::exp((1.0 - range) / kNearDecay); }

/// d range / d RangeErrors::per_decade. @param intensity  as reported; below 1 counts as 1
inline double intensity_decades(double intensity) {
  return std::log10(kWalkIntensity / std::max(intensity, 1.0));
}

/// Half the difference in range between the ends of a footprint on a tilted surface, m, which
/// d range / d RangeErrors::incidence is.
/// @param range             m
/// @param slope_horizontal  tangent of the angle of incidence within the plane of the beam and the
///                          horizontal axis of the footprint
/// @param slope_vertical    the same along its vertical axis
/// @param divergence_horizontal, divergence_vertical  full angles, rad
inline double footprint_depth(double range, double slope_horizontal, double slope_vertical,
                              double divergence_horizontal, double divergence_vertical) {
  return 0.5 * range *
         std::hypot(slope_horizontal * divergence_horizontal, slope_vertical * divergence_vertical);
}

}  // namespace risley::sensors
