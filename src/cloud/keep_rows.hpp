// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

namespace risley::cloud {

/// @throws InvalidArgument unless rows ascend and are of a table of that size
inline void require_rows(std::span<const std::size_t> rows, std::size_t size) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    require_place("row", rows[i], size);
    if (i > 0 && rows[i] <= rows[i - 1]) {
      throw InvalidArgument(
          fmt::format("row = {} after row {}, allowed ascending", rows[i], rows[i - 1]));
    }
  }
}

/// Keeps only these rows of a column, which may be empty.
template <class Column>
void keep_rows(Column& column, std::span<const std::size_t> rows) {
  if (column.empty()) return;
  for (std::size_t i = 0; i < rows.size(); ++i) column[i] = column[rows[i]];
  column.resize(rows.size());
}

}  // namespace risley::cloud
