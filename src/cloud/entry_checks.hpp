// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/cloud/points.hpp"
#include "risley/cloud/sensor_poses.hpp"
#include "risley/core/require.hpp"

#include "cloud/point_columns.hpp"

namespace risley::cloud {

inline void require_poses(const SensorPoses& poses, std::size_t shots) {
  require_length("poses", poses.size(), shots);
  for (const auto& column : poses.turn) require_length("turn of poses", column.size(), shots);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    require_length("reference of poses", poses.reference[axis].size(), shots);
    require_length("velocity of poses", poses.velocity[axis].size(), shots);
    require_length("rate of poses", poses.rate[axis].size(), shots);
  }
}

/// The columns that compute_points() fills, as far as a header announces them.
inline void require_computed_columns(const Points& points, const CloudHeader& header,
                                     std::size_t rows) {
  if (header.has_rotation_angles) {
    require_length("rotation_angle", points.rotation_angle.size(), header.prisms);
  }
  require_length("loading", points.loading.size(), header.factors.size());
  visit_computed_columns(points, header, [rows](const auto& column, const char* name, bool there) {
    if (there) require_length(name, column.size(), rows);
  });
  for (const auto& column : points.own_covariance) {
    require_length("own_covariance", column.size(), header.has_own_covariance ? rows : 0);
  }
}

/// All columns that a header announces.
inline void require_columns(const Points& points, const CloudHeader& header) {
  const std::size_t rows = points.size();
  require_computed_columns(points, header, rows);
  visit_columns(points, header, [rows](const auto& column, const char* name, bool there) {
    if (there) require_length(name, column.size(), rows);
  });
  require_length("point_source", points.point_source.size(), header.has_point_source ? rows : 0);
}

}  // namespace risley::cloud
