// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/core/simd.hpp"

namespace risley {

/// Sums of the products of all pairs of columns, for kernels: a row holds one group of shots, a
/// lane each. The products are summed in squares of as many rows and columns as the registers hold,
/// over as many groups at once as fit the nearest cache.
/// @tparam Most  columns at most
/// @tparam Tile  side of the squares
template <class Batch, std::size_t Most, std::size_t Tile = Batch::size == 8 ? 4 : 3>
class ColumnProducts {
 public:
  static constexpr std::size_t kTile = Tile;  ///< side of the squares
  /// Squares beside each other.
  static constexpr std::size_t tiles_of(std::size_t columns) {
    return (columns + kTile - 1) / kTile;
  }
  /// Size of a padded row of this many columns; those after the last one must be zero.
  static constexpr std::size_t padded(std::size_t columns) { return tiles_of(columns) * kTile; }

  /// @param columns  at most Most
  explicit ColumnProducts(std::size_t columns) { start(columns); }
  /// Starts from zero, with this many columns.
  void start(std::size_t columns) {
    columns_ = columns;
    tiles_ = tiles_of(columns);
    const Batch zero(0.0);
    for (std::size_t i = 0; i < tiles_ * (tiles_ + 1) / 2 * kTile * kTile; ++i) sums_[i] = zero;
  }

  /// Adds the products of some groups.
  /// @param stride  from row to row, padded(columns) and more
  void add(const Batch* rows, std::size_t stride, std::size_t groups) {
    Batch* sums = sums_;
    for (std::size_t i = 0; i < tiles_; ++i) {
      for (std::size_t j = i; j < tiles_; ++j, sums += kTile * kTile) {
        add_tile(rows + i * kTile, rows + j * kTile, stride, groups, sums);
      }
    }
  }

  /// Sum of the products of columns i and j, with i not above j.
  const Batch& sum(std::size_t i, std::size_t j) const {
    const std::size_t row = i / kTile;
    const Batch* tile = sums_ + (row * tiles_ - row * (row + 1) / 2 + j / kTile) * kTile * kTile;
    return tile[i % kTile * kTile + j % kTile];
  }
  /// Writes the upper triangle row by row.
  void store(double* out) const {
    for (std::size_t i = 0; i < columns_; ++i) {
      for (std::size_t j = i; j < columns_; ++j) *out++ = sum_of_lanes(sum(i, j));
    }
  }

 private:
  static constexpr std::size_t kMost = tiles_of(Most);

  static void add_tile(const Batch* left, const Batch* right, std::size_t stride,
                       std::size_t groups, Batch* sums) {
    Batch sum[kTile][kTile];
    for (std::size_t i = 0; i < kTile; ++i) {
      for (std::size_t j = 0; j < kTile; ++j) sum[i][j] = sums[i * kTile + j];
    }
    for (std::size_t group = 0; group < groups; ++group, left += stride, right += stride) {
      for (std::size_t i = 0; i < kTile; ++i) {
        for (std::size_t j = 0; j < kTile; ++j)
          sum[i][j] = xsimd::fma(left[i], right[j], sum[i][j]);
      }
    }
    for (std::size_t i = 0; i < kTile; ++i) {
      for (std::size_t j = 0; j < kTile; ++j) sums[i * kTile + j] = sum[i][j];
    }
  }

  std::size_t columns_ = 0, tiles_ = 0;
  Batch sums_[kMost * (kMost + 1) / 2 * kTile * kTile];
};

}  // namespace risley
