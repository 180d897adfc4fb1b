// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "calibration/point_noise.hpp"
#include "calibration/sorted_rows.hpp"

namespace risley::calibration {

/// Directions as two angles from the middle of all, rad, equidistant in every direction. Also a
/// grid of cells over them.
class DirectionGrid {
 public:
  explicit DirectionGrid(const std::vector<Beam>& beams);

  double width() const { return width_; }
  std::size_t cells() const { return static_cast<std::size_t>(size_[0] * size_[1]); }
  std::size_t cell(std::size_t beam) const { return static_cast<std::size_t>(cell_[beam]); }
  std::span<const std::size_t> beams_in(std::size_t cell) const { return beams_.of(cell); }
  /// The cell at this offset in columns and rows, or none outside the field of view.
  std::optional<std::size_t> shifted(std::size_t cell, int columns, int rows) const {
    const int column = static_cast<int>(cell) % size_[0] + columns;
    const int row = static_cast<int>(cell) / size_[0] + rows;
    if (column < 0 || row < 0 || column >= size_[0] || row >= size_[1]) return std::nullopt;
    return static_cast<std::size_t>(row * size_[0] + column);
  }
  /// Counts of cells summed over each cell and its eight neighbours.
  std::vector<std::uint32_t> block_sums(const std::vector<std::uint32_t>& counts) const;

  /// Width of the beams' field in its shorter principal direction, rad. The outer tails are cut and
  /// the rest extrapolated, so that single outliers do not widen a row of points.
  double shorter_extent(const std::vector<std::size_t>& beams) const;

 private:
  std::vector<std::array<double, 2>> angles_;
  double width_ = 0;
  std::array<int, 2> size_{};
  std::vector<int> cell_;
  SortedRows<> beams_;  ///< by cell
};

}  // namespace risley::calibration
