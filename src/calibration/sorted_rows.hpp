// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <numeric>
#include <span>
#include <vector>

namespace risley::calibration {

/// Rows sorted by a number below `count`, in their own order for equal numbers. Rows with another
/// number, such as a negative one, are dropped.
template <class Row = std::size_t>
struct SortedRows {
  std::vector<std::size_t> begin{0};  ///< [count + 1]
  std::vector<Row> rows;

  SortedRows() = default;
  /// @param number_of  of each row
  template <class NumberOf>
  SortedRows(std::size_t count, std::size_t size, const NumberOf& number_of) : begin(count + 1) {
    const auto for_each = [&](const auto& function) {
      for (std::size_t i = 0; i < size; ++i) {
        const auto number = static_cast<std::size_t>(number_of(i));
        if (number < count) function(number, i);
      }
    };
    for_each([&](std::size_t number, std::size_t) { ++begin[number + 1]; });
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    rows.resize(begin.back());
    std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
    for_each(
        [&](std::size_t number, std::size_t i) { rows[next[number]++] = static_cast<Row>(i); });
  }

  std::span<const Row> of(std::size_t number) const {
    return {rows.data() + begin[number], begin[number + 1] - begin[number]};
  }
};

}  // namespace risley::calibration
