// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/points.hpp"

#include "risley/core/require.hpp"
#include "risley/optics/prism.hpp"

#include "cloud/keep_rows.hpp"
#include "cloud/point_columns.hpp"

namespace risley::cloud {
void Points::keep(std::span<const std::size_t> rows) {
  require_rows(rows, size());
  visit_columns(*this, {}, [rows](auto& column, auto...) { keep_rows(column, rows); });
}

void CloudHeader::resize(Points& points, std::size_t rows) const {
  require_between("number of prisms", prisms, 1, kMaxPrisms);
  points.rotation_angle.resize(has_rotation_angles ? prisms : 0);
  points.loading.resize(factors.size());
  visit_columns(points, *this,
                [rows](auto& column, const char*, bool there) { column.resize(there ? rows : 0); });
}

}  // namespace risley::cloud
