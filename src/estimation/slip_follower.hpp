// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/initialisation.hpp"

#include "estimation/block_fit.hpp"

namespace risley::estimation {

/// Lower bound of the noise, as a share of the step from shot to shot: more accuracy is not needed.
inline constexpr double kLeastNoiseSteps = 0.2;
/// The valid shots of a recording by their numbers in the count.
struct NumberedShots {
  AngleSeries series;  // in the sensor's frame
  std::vector<std::int64_t> number;
  double rate = 0;
  std::vector<std::uint8_t> firing_order;  // empty: beams are those of the series

  std::size_t size() const { return number.size(); }
  std::int64_t time_ns(std::size_t i, std::int64_t lag) const {
    return std::llround(static_cast<double>(number[i] + lag) * 1e9 / rate);
  }
  std::uint8_t beam(std::size_t i, std::int64_t lag) const {
    if (firing_order.empty()) return series.beam[i];
    const auto emitters = static_cast<std::int64_t>(firing_order.size());
    return firing_order[static_cast<std::size_t>(((number[i] + lag) % emitters + emitters) %
                                                 emitters)];
  }
  /// Shot i if this many shots are missing before it.
  void append_to(AngleSeries& to, std::size_t i, std::int64_t lag) const {
    to.append(time_ns(i, lag), series.azimuth[i], series.zenith[i], beam(i, lag),
              series.azimuth_rounding_variance[i], series.zenith_rounding_variance[i]);
  }
};

/// A change of the count after valid shot `before` and not after shot `after`.
struct FoundSlip {
  std::size_t before = 0, after = 0;
  std::int64_t shots = 0;
};

/// Result of following the rotors of a stretch.
struct Followed {
  std::size_t begin = 0, end = 0;  // valid shots that were reached
  std::vector<FoundSlip> slips;    // ascending
  double residual_rms = 0;         // of predictions, typical, rad
  std::size_t size() const { return end > begin ? end - begin : 0; }
};

/// A stretch with known rotors at one time.
struct Anchor {
  Start start;
  std::size_t shot = 0;  // valid shot next to it
  std::vector<std::uint8_t> firing_order;
};

/// Fits a state to all of some shots, as if they were free of slips.
/// @param noise  of the shots about the fit, rad; raised to kLeastNoiseSteps
/// @param from  initial noise: initial error of the directions, rad
/// @return scale of the residuals, rad
double settle(const NumberedShots& shots, ShotRange rows, const Start& start, double noise,
              double from, RotorState& state);

/// Follows the rotors from an anchor to both ends of a stretch, or as far as possible.
Followed follow(const NumberedShots& shots, const Anchor& anchor, ShotRange range);

}  // namespace risley::estimation
