// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace risley::scenes {

/// A random field over a wall: kSinusoidsOfWaves sinusoids of equal amplitude and of random
/// direction, phase and length.
struct WallWaves {
  double peak_to_valley = 0;  ///< of one sinusoid with the rms of the field, m; see rms()
  double half_wave = 0;       ///< m; the sinusoids' own are 1/sqrt(2) to sqrt(2) times as long
  std::uint64_t seed = 0;     ///< equal seeds and lengths give equal waves

  double rms() const;  ///< of the field, over all seeds and places: peak_to_valley / sqrt(8), m
};

/// Number of sinusoids of one random field.
inline constexpr int kSinusoidsOfWaves = 16;

/// Deviation of a wall from its plane at one place.
struct Deviation {
  double height = 0;            ///< along the plane's normal, m
  double horizontal_slope = 0;  ///< d height / d place along the plane's horizontal axis, 1
  double vertical_slope = 0;    ///< the same along its vertical axis, 1
};

/// Deviation of a wall from its plane without steps: waves and a bow.
class WallShape {
 public:
  WallShape() = default;  ///< flat

  /// @param bow     height in the middle of the extent; one half wave of a cosine along both axes,
  ///                0 at all four edges, m; positive away from the scene's origin
  /// @param extent  width and height, m; needed only for a bow
  /// @param center  of the extent from the plane's foot, m
  /// @throws InvalidArgument for non-finite numbers, half waves not above 0, a negative peak to
  /// valley and a bow without extent
  WallShape(std::span<const WallWaves> waves, double bow,
            const std::optional<std::array<double, 2>>& extent,
            const std::array<double, 2>& center);

  bool flat() const { return fields_.empty() && bow_ == 0.0; }  ///< the deviation is 0 everywhere
  /// @param horizontal, vertical  from the plane's foot, along its axes, m
  Deviation at(double horizontal, double vertical) const;

  double highest() const { return highest_; }      ///< no |height| is above this, m
  double steepest() const { return steepest_; }    ///< upper bound of the slope in any direction, 1
  double strongest_bend() const { return bend_; }  ///< upper bound of the second derivatives, 1/m

 private:
  using Each = std::array<double, kSinusoidsOfWaves>;
  /// The sum of amplitude sin(2 pi (horizontal * horizontal_wave + vertical * vertical_wave +
  /// phase)); waves in turns per metre, phases in turns.
  struct Field {
    double amplitude = 0;
    Each horizontal_wave{}, vertical_wave{}, phase{};
  };

  std::vector<Field> fields_;
  double bow_ = 0;
  std::array<double, 2> bow_wave_{0.0, 0.0}, center_{0.0, 0.0};
  double highest_ = 0, steepest_ = 0, bend_ = 0;
};

}  // namespace risley::scenes
