// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "recordings/formats/text_table.hpp"

// How coarse the numbers of a file are, told by the numbers themselves.
namespace risley::recordings {

/// What the cells of a column are stored as.
enum class CellType : std::uint8_t { text, integer, float32, float64 };

/// How values are rounded: to multiples of a step, or to so many digits that each value has a step
/// of its own. Both 0 where they are not rounded, or it is not known.
struct Rounding {
  double step = 0.0;      ///< in the unit of the values
  double relative = 0.0;  ///< of the value
  int decimals = -1;      ///< of texts: of the longest number seen; of others beyond any

  double step_at(double value) const { return step > 0.0 ? step : relative * std::abs(value); }
  /// Later numbers of a text may be longer than those looked at.
  void notice(const Decimal& cell) {
    if (cell.decimals <= decimals) return;
    decimals = cell.decimals;
    step = std::pow(10.0, -decimals);
  }
};

/// Finds out how the values of one or several columns are rounded: whether all are whole multiples
/// of 1, 0.1, ... 10^-6 as exactly as their type can hold these; if not, texts have the step of
/// their last decimal and float32 its own precision.
Rounding rounding_of(std::span<const std::vector<Decimal>* const> columns, CellType type);

/// The largest power of ten of which all numbers are multiples: what was measured in millimetres
/// may stand in tenths of them. 1 where the numbers change too rarely to tell, as those of a plane
/// at a round distance do.
std::int64_t common_power_of_ten(std::span<const std::int64_t> numbers);

}  // namespace risley::recordings
