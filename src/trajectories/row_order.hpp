// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "risley/trajectories/trajectory.hpp"

namespace risley::trajectories {

/// The order that sorts rows by time.
struct RowOrder {
  TimeOrder times;
  std::vector<std::size_t> rows;  ///< row i comes from rows[i]; empty if all stay
};

/// Rows sorted by time; of rows with the same time the first stays.
RowOrder row_order(const std::vector<std::int64_t>& times_ns);

/// Row order[i] moves to row i; empty columns stay empty.
template <class T>
void reorder(std::vector<T>& column, const std::vector<std::size_t>& order) {
  if (column.empty()) return;
  std::vector<T> sorted;
  sorted.reserve(order.size());
  for (const std::size_t row : order) sorted.push_back(column[row]);
  column = std::move(sorted);
}

}  // namespace risley::trajectories
