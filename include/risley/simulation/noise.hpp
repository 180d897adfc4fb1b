// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

#include "risley/core/random.hpp"

namespace risley::simulation {

/// Errors that a sensor adds to the true numbers before it reports them.
struct NoiseSettings {
  double angle = 0;             ///< 1 sigma, white, of azimuth and of zenith, rad     [B21 3.2]
  double range = 0;             ///< 1 sigma, white, m                                 [B21 3.3]
  double angle_resolution = 0;  ///< angles are rounded to multiples of this, rad; 0: not rounded
  double range_resolution = 0;  ///< the same of ranges, m
};

/// Noise and rounding of a recording. As in the paper the angular noise is added to the two angles
/// themselves, so near the pole it shrinks across the beam by the sine of the zenith angle. The
/// noise of a shot depends only on the seed and the shot's number.
class ObservationNoise {
 public:
  /// @throws InvalidArgument for a negative or infinite setting
  ObservationNoise(const NoiseSettings& settings, std::uint64_t seed);

  /// Changes the columns of consecutive shots in place; azimuth stays in (-pi, pi] and zenith in
  /// [0, pi], and NaN stays NaN. @throws InvalidArgument for columns of different lengths
  void apply_to_angles(std::uint64_t first_shot, std::span<double> azimuth,
                       std::span<double> zenith) const;
  /// The same for ranges, m. A range of 0, which stands for no return, stays 0; another range does
  /// not fall below 0.
  void apply_to_ranges(std::uint64_t first_shot, std::span<double> range) const;

  const NoiseSettings& settings() const { return settings_; }  ///< as they were given

 private:
  NoiseSettings settings_;
  RandomStream azimuth_, zenith_, range_;
};

}  // namespace risley::simulation
