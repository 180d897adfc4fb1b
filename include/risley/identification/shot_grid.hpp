// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "risley/estimation/angle_series.hpp"

namespace risley::identification {

/// Shots on the grid of the clock that fired them: shot i stands `slot[i]` steps after the first.
/// Slots of missing shots stay empty.
struct ShotGrid {
  std::int64_t origin_ns = 0;  ///< time of slot 0
  double step = 0;             ///< s
  bool regular = false;        ///< times are whole steps; otherwise those recorded are used
  std::vector<std::int64_t> slot;
  std::vector<double> time;             ///< s after slot 0
  std::vector<double> azimuth, zenith;  ///< rad
  std::vector<std::uint8_t> emitter;    ///< index among those named in the recording, from 0
  int emitters = 1;                     ///< that the recording names

  std::size_t size() const { return slot.size(); }
  /// From slot 0 to the last shot, s.
  double duration() const { return size() == 0 ? 0.0 : time.back(); }
};

/// Finds the step of the clock from all times together, so that their rounding does not limit it.
/// @param series  in the order of time, without resets
/// @throws EstimationError for fewer than 40 shots, or more than half of the times equal
ShotGrid shot_grid(const estimation::AngleSeries& series, estimation::ShotRange rows);

/// Some rows of a grid, ascending; origin and step stay.
ShotGrid rows_of(const ShotGrid& grid, std::span<const std::size_t> rows);
/// Rows [begin, end).
ShotGrid rows_of(const ShotGrid& grid, std::size_t begin, std::size_t end);

}  // namespace risley::identification
