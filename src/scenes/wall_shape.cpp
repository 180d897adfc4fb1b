// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/scenes/wall_shape.hpp"

#include <cmath>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/core/require.hpp"

namespace risley::scenes {
namespace {

/// Number of the random stream; those of simulations and of villages are others.
constexpr std::uint64_t kWallWaves = 202;

}  // namespace

double WallWaves::rms() const { return peak_to_valley / std::sqrt(8.0); }

WallShape::WallShape(std::span<const WallWaves> waves, double bow,
                     const std::optional<std::array<double, 2>>& extent,
                     const std::array<double, 2>& center)
    : bow_(bow), center_(center) {
  for (const WallWaves& each : waves) {
    require_not_below("peak_to_valley", each.peak_to_valley, 0, "m");
    require_above("half_wave", each.half_wave, 0, "m");
    if (each.peak_to_valley == 0.0) continue;
    const RandomStream random(each.seed, kWallWaves);
    const double amplitude = each.rms() * std::sqrt(2.0 / kSinusoidsOfWaves);
    for (int i = 0; i < kSinusoidsOfWaves; ++i) {
      const auto number = 3 * static_cast<std::uint64_t>(i);
      // One direction in each equal part of half a turn, so that no direction is preferred.
      const double direction = kPi * (i + random.uniform(number)) / kSinusoidsOfWaves;
      const double wave = kPi / (each.half_wave * std::exp2(random.uniform(number + 1) - 0.5));
      sines_.push_back({amplitude, wave * std::cos(direction), wave * std::sin(direction),
                        kTwoPi * random.uniform(number + 2)});
      highest_ += amplitude;
      steepest_ += amplitude * wave;
      bend_ += amplitude * wave * wave;
    }
  }
  require_finite("bow", bow, "m");
  if (bow == 0.0) return;
  if (!extent) throw InvalidArgument("a bow needs an extent");
  for (std::size_t i = 0; i < 2; ++i) {
    require_above("extent", (*extent)[i], 0, "m");
    require_finite("center", center[i], "m");
    bow_wave_[i] = kPi / (*extent)[i];
  }
  const double wave = std::hypot(bow_wave_[0], bow_wave_[1]);
  highest_ += std::abs(bow);
  steepest_ += std::abs(bow) * wave;
  bend_ += std::abs(bow) * wave * wave;
}

Deviation WallShape::at(double horizontal, double vertical) const {
  Deviation sum;
  for (const Sine& sine : sines_) {
    const double phase =
        horizontal * sine.horizontal_wave + vertical * sine.vertical_wave + sine.phase;
    const double change = sine.amplitude * std::cos(phase);
    sum.height += sine.amplitude * std::sin(phase);
    sum.horizontal_slope += change * sine.horizontal_wave;
    sum.vertical_slope += change * sine.vertical_wave;
  }
  if (bow_ != 0.0) {
    const double across = bow_wave_[0] * (horizontal - center_[0]);
    const double up = bow_wave_[1] * (vertical - center_[1]);
    sum.height += bow_ * std::cos(across) * std::cos(up);
    sum.horizontal_slope -= bow_ * bow_wave_[0] * std::sin(across) * std::cos(up);
    sum.vertical_slope -= bow_ * bow_wave_[1] * std::cos(across) * std::sin(up);
  }
  return sum;
}

}  // namespace risley::scenes
