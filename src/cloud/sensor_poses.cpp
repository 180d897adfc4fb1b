// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/sensor_poses.hpp"

#include "cloud/keep_rows.hpp"

namespace risley::cloud {
namespace {

/// Calls function(column) for every column.
template <class Function>
void for_each_column(SensorPoses& poses, const Function& function) {
  for (auto& column : poses.turn) function(column);
  for (auto* columns : {&poses.reference, &poses.velocity, &poses.rate}) {
    for (auto& column : *columns) function(column);
  }
  function(poses.strip);
}

}  // namespace

void SensorPoses::resize(std::size_t shots) {
  for_each_column(*this, [shots](auto& column) { column.resize(shots); });
}

void SensorPoses::keep(std::span<const std::size_t> rows) {
  require_rows(rows, size());
  for_each_column(*this, [rows](auto& column) { keep_rows(column, rows); });
}

}  // namespace risley::cloud
