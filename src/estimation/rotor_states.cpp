// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/rotor_states.hpp"

#include "risley/core/require.hpp"

namespace risley::estimation {

static_assert(lists_all_columns<RotorStates, kRotorStateColumns>());
static_assert(lists_all_columns<AngleSeries, kSeriesColumns>());

void RotorStates::resize(int prisms, std::size_t shots) {
  const auto n = static_cast<std::size_t>(prisms);
  for (auto* columns : {&rotation_angle, &angular_velocity, &angular_velocity_sigma}) {
    columns->resize(n);
  }
  rotation_angle_covariance.resize(n * (n + 1) / 2);
  for_each_column<kRotorStateColumns>([shots](auto& column) { column.resize(shots); }, *this);
}

RotorStates rows_of(const RotorStates& all, ShotRange shots) {
  require_rows("shots", shots.begin, shots.end, all.size());
  RotorStates rows;
  rows.resize(all.prisms(), 0);
  for_each_column<kRotorStateColumns>(
      [shots](const auto& from, auto& to) {
        to.assign(from.begin() + static_cast<std::ptrdiff_t>(shots.begin),
                  from.begin() + static_cast<std::ptrdiff_t>(shots.end));
      },
      all, rows);
  return rows;
}

}  // namespace risley::estimation
