// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/scenes/wall_shape.hpp"

#include <cmath>
#include <cstddef>
#include <utility>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/core/require.hpp"

namespace risley::scenes {
namespace {

/// Number of the random stream; simulations and villages use others.
constexpr std::uint64_t kWallWaves = 202;

/// sin(x) / x and cos(x) of x^2 for |x| <= pi / 2, accurate to 5e-14: Taylor's series. Unrolled, so
/// that compilers process several sinusoids at once.
inline double sine_by_angle(double s) {
  return 1.0 + s * (-1.0 / 6 +
                    s * (1.0 / 120 +
                         s * (-1.0 / 5040 +
                              s * (1.0 / 362880 + s * (-1.0 / 39916800 +
                                                       s * (1.0 / 6227020800 +
                                                            s * (-1.0 / 1307674368000 +
                                                                 s * (1.0 / 355687428096000))))))));
}

inline double cosine(double s) {
  return 1.0 +
         s * (-1.0 / 2 +
              s * (1.0 / 24 +
                   s * (-1.0 / 720 + s * (1.0 / 40320 +
                                          s * (-1.0 / 3628800 +
                                               s * (1.0 / 479001600 +
                                                    s * (-1.0 / 87178291200 +
                                                         s * (1.0 / 20922789888000 +
                                                              s * (-1.0 / 6402373705728000)))))))));
}

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
    Field& field = fields_.emplace_back();
    field.amplitude = each.rms() * std::sqrt(2.0 / kSinusoidsOfWaves);
    for (std::size_t i = 0; i < kSinusoidsOfWaves; ++i) {
      const std::uint64_t number = 3 * i;
      // One direction in each equal part of half a turn, so that no direction is preferred.
      const double direction =
          kPi * (static_cast<double>(i) + random.uniform(number)) / kSinusoidsOfWaves;
      const double wave = kPi / (each.half_wave * std::exp2(random.uniform(number + 1) - 0.5));
      field.horizontal_wave[i] = wave * std::cos(direction) / kTwoPi;
      field.vertical_wave[i] = wave * std::sin(direction) / kTwoPi;
      field.phase[i] = random.uniform(number + 2);
      highest_ += field.amplitude;
      steepest_ += field.amplitude * wave;
      bend_ += field.amplitude * wave * wave;
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
  for (const Field& field : fields_) {
    Each sines, cosines;
    for (std::size_t i = 0; i < kSinusoidsOfWaves; ++i) {
      const double turns = horizontal * field.horizontal_wave[i] +
                           vertical * field.vertical_wave[i] + field.phase[i];
      constexpr double kWhole = 0x1.8p52;  // a sum with it is a whole number
      const double half_angle = kPi * (turns - ((turns + kWhole) - kWhole));
      const double square = half_angle * half_angle;
      const double half_sine = half_angle * sine_by_angle(square);
      sines[i] = 2.0 * half_sine * cosine(square);
      cosines[i] = 1.0 - 2.0 * half_sine * half_sine;
    }
    Deviation own;
    for (std::size_t i = 0; i < kSinusoidsOfWaves; ++i) {
      own.height += sines[i];
      own.horizontal_slope += cosines[i] * field.horizontal_wave[i];
      own.vertical_slope += cosines[i] * field.vertical_wave[i];
    }
    sum.height += field.amplitude * own.height;
    sum.horizontal_slope += kTwoPi * field.amplitude * own.horizontal_slope;
    sum.vertical_slope += kTwoPi * field.amplitude * own.vertical_slope;
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
