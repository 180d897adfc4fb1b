// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "recordings/formats/text_table.hpp"

// How coarse the numbers of a file are, found from the numbers themselves.
namespace risley::recordings {

/// Storage type of a column's cells.
enum class CellType : std::uint8_t { text, integer, float32, float64 };

/// How values are rounded: to multiples of a step, or to so many digits that each value has a step
/// of its own. Both 0 if they are not rounded, or it is not known.
struct Rounding {
  double step = 0.0;      ///< in the unit of the values
  double relative = 0.0;  ///< of the value
  int decimals = -1;      ///< of texts: of the longest number seen; of others unlimited

  double step_at(double value) const { return step > 0.0 ? step : relative * std::abs(value); }
  /// Later numbers of a text may be longer than those seen.
  void notice(const Decimal& cell) {
    if (cell.decimals <= decimals) return;
    decimals = cell.decimals;
    step = std::pow(10.0, -decimals);
  }
};

/// Finds the rounding of the values of one or several columns: whether all are whole multiples of
/// 1, 0.1, ... 10^-6 as exactly as their type can hold these; if not, texts have the step of their
/// last decimal and float32 its own precision.
Rounding rounding_of(std::span<const std::vector<Decimal>* const> columns, CellType type);

/// The largest power of ten that divides all numbers: measurements in millimetres may be stored in
/// tenths of them. 1 if the numbers change too rarely to show it, as for a plane at a round
/// distance.
std::int64_t common_power_of_ten(std::span<const std::int64_t> numbers);

}  // namespace risley::recordings
