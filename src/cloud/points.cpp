// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/points.hpp"

#include "risley/core/require.hpp"
#include "risley/optics/prism.hpp"

#include "cloud/keep_rows.hpp"

namespace risley::cloud {

static_assert(lists_all_columns<Points, kPointColumns>());

void Points::keep(std::span<const std::size_t> rows) {
  require_rows(rows, size());
  for_each_point_column(*this, [rows](const auto&, auto& column) { keep_rows(column, rows); });
}

bool CloudHeader::announces(const PointColumn& column) const {
  return column.announced == nullptr || this->*column.announced;
}

void CloudHeader::resize(Points& points, std::size_t rows) const {
  require_between("number of prisms", prisms, 1, kMaxPrisms);
  points.rotation_angle.resize(has_rotation_angles ? prisms : 0);
  points.loading.resize(factors.size());
  for_each_point_column(points, [&](const PointColumn& entry, auto& column) {
    column.resize(announces(entry) ? rows : 0);
  });
}

}  // namespace risley::cloud
