// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Cells and pixels of the ground, in square tiles that are created where points fall.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley::cloud {

/// Cells of the counts along the side of a square.
inline constexpr std::int32_t kTileCells = 16;
inline constexpr std::size_t kMostTiles = 100'000;
inline constexpr std::int32_t kTilePixels = 64;

inline std::int32_t cell_number(double value, double cell) {
  return static_cast<std::int32_t>(std::floor(value / cell));
}

/// Floor of a division, for numbers of tiles.
constexpr std::int32_t divided(std::int32_t value, std::int32_t by) {
  return value >= 0 ? value / by : -((by - 1 - value) / by);
}

/// Squares of ground, each with its data, created on first access.
template <class Tile>
class TileMap {
 public:
  Tile* find(std::int32_t column, std::int32_t row) const {
    const std::uint64_t key = key_of(column, row);
    if (key == last_key_) return last_;
    const auto at = tiles_.find(key);
    return at == tiles_.end() ? nullptr : at->second.get();
  }
  /// nullptr if there would be more than `most`.
  Tile* open(std::int32_t column, std::int32_t row, std::size_t most) {
    const std::uint64_t key = key_of(column, row);
    if (key == last_key_) return last_;
    auto at = tiles_.find(key);
    if (at == tiles_.end()) {
      if (tiles_.size() >= most) return nullptr;
      at = tiles_.emplace(key, std::make_unique<Tile>()).first;
    }
    last_key_ = key;
    last_ = at->second.get();
    return last_;
  }
  template <class Visit>
  void for_each(Visit visit) const {
    for (const auto& [key, tile] : tiles_) {
      visit(static_cast<std::int32_t>(key & 0xffffffffU), static_cast<std::int32_t>(key >> 32U),
            *tile);
    }
  }
  void clear() {
    tiles_.clear();
    last_ = nullptr;
    last_key_ = kNoKey;
  }

 private:
  /// Farther out than any point.
  static constexpr std::uint64_t kNoKey = 0x8000000080000000U;
  static std::uint64_t key_of(std::int32_t column, std::int32_t row) {
    return std::uint64_t{static_cast<std::uint32_t>(row)} << 32U |
           static_cast<std::uint32_t>(column);
  }
  std::unordered_map<std::uint64_t, std::unique_ptr<Tile>> tiles_;
  Tile* last_ = nullptr;
  std::uint64_t last_key_ = kNoKey;
};

template <class Cell>
using CellTile = std::array<Cell, std::size_t{kTileCells} * kTileCells>;

template <class Cell>
Cell* cell_at(const TileMap<CellTile<Cell>>& tiles, std::int32_t column, std::int32_t row) {
  const std::int32_t i = divided(column, kTileCells), j = divided(row, kTileCells);
  CellTile<Cell>* tile = tiles.find(i, j);
  if (tile == nullptr) return nullptr;
  return &(*tile)[(row - j * kTileCells) * kTileCells + column - i * kTileCells];
}

template <class Cell>
Cell& opened_cell(TileMap<CellTile<Cell>>& tiles, std::int32_t column, std::int32_t row,
                  double cell) {
  const std::int32_t i = divided(column, kTileCells), j = divided(row, kTileCells);
  CellTile<Cell>* tile = tiles.open(i, j, kMostTiles);
  if (tile == nullptr) {
    throw InvalidArgument(fmt::format(
        "points lie on more than {:.3g} km^2 of ground, which is too much for cells of {:g} m: "
        "count in larger ones",
        1e-6 * static_cast<double>(kMostTiles) * std::pow(kTileCells * cell, 2), cell));
  }
  return (*tile)[(row - j * kTileCells) * kTileCells + column - i * kTileCells];
}

/// Which pixels hold a point, row by row.
using PixelTile = std::array<std::uint64_t, kTilePixels>;

inline void mark(PixelTile& tile, std::int32_t column, std::int32_t row) {
  tile[row - divided(row, kTilePixels) * kTilePixels] |=
      std::uint64_t{1} << static_cast<unsigned>(column -
                                                divided(column, kTilePixels) * kTilePixels);
}

inline bool is_marked(const TileMap<PixelTile>& tiles, std::int32_t column, std::int32_t row) {
  const PixelTile* tile = tiles.find(divided(column, kTilePixels), divided(row, kTilePixels));
  if (tile == nullptr) return false;
  return ((*tile)[row - divided(row, kTilePixels) * kTilePixels] >>
              static_cast<unsigned>(column - divided(column, kTilePixels) * kTilePixels) &
          1U) != 0;
}

}  // namespace risley::cloud
