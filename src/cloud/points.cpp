// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/points.hpp"

#include "risley/core/require.hpp"
#include "risley/optics/prism.hpp"

#include "cloud/keep_rows.hpp"

namespace risley::cloud {
namespace {

/// Calls function(column) for every column.
template <class Function>
void for_each_column(Points& p, const Function& function) {
  function(p.time_ns);
  for (auto* column :
       {&p.x, &p.y, &p.z, &p.range, &p.incidence, &p.azimuth_residual, &p.zenith_residual}) {
    function(*column);
  }
  for (auto& column : p.covariance) function(column);
  for (auto& column : p.own_covariance) function(column);
  function(p.point_source);
  for (auto& column : p.rotation_angle) function(column);
  for (auto* column : {&p.intensity, &p.return_number, &p.number_of_returns, &p.tag, &p.beam}) {
    function(*column);
  }
  for (auto& factor : p.loading) {
    for (auto& column : factor) function(column);
  }
}

}  // namespace

void Points::keep(std::span<const std::size_t> rows) {
  require_rows(rows, size());
  for_each_column(*this, [rows](auto& column) { keep_rows(column, rows); });
}

void CloudHeader::resize(Points& points, std::size_t rows) const {
  require_between("number of prisms", prisms, 1, kMaxPrisms);
  points.time_ns.resize(rows);
  for (auto* column : {&points.x, &points.y, &points.z, &points.range, &points.incidence}) {
    column->resize(rows);
  }
  for (auto& column : points.covariance) column.resize(has_covariance ? rows : 0);
  for (auto& column : points.own_covariance) column.resize(has_own_covariance ? rows : 0);
  points.point_source.resize(has_point_source ? rows : 0);
  const std::size_t angle_rows = has_rotation_angles ? rows : 0;
  points.rotation_angle.resize(has_rotation_angles ? static_cast<std::size_t>(prisms) : 0);
  for (auto& column : points.rotation_angle) column.resize(angle_rows);
  points.azimuth_residual.resize(angle_rows);
  points.zenith_residual.resize(angle_rows);
  for (auto* column : {&points.intensity, &points.return_number, &points.number_of_returns,
                       &points.tag, &points.beam}) {
    column->resize(rows);
  }
  points.loading.resize(factors.size());
  for (auto& factor : points.loading) {
    for (auto& column : factor) column.resize(rows);
  }
}

}  // namespace risley::cloud
