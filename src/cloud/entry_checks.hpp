// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/cloud/points.hpp"
#include "risley/cloud/sensor_poses.hpp"
#include "risley/core/require.hpp"

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
  require_length("x", points.x.size(), rows);
  require_length("y", points.y.size(), rows);
  require_length("z", points.z.size(), rows);
  require_length("range", points.range.size(), rows);
  require_length("incidence", points.incidence.size(), rows);
  if (header.has_covariance) {
    for (const auto& column : points.covariance) require_length("covariance", column.size(), rows);
  }
  for (const auto& column : points.own_covariance) {
    require_length("own_covariance", column.size(), header.has_own_covariance ? rows : 0);
  }
  if (header.has_rotation_angles) {
    require_length("rotation_angle", points.rotation_angle.size(),
                   static_cast<std::size_t>(header.prisms));
    for (const auto& column : points.rotation_angle) {
      require_length("rotation_angle of a prism", column.size(), rows);
    }
    require_length("azimuth_residual", points.azimuth_residual.size(), rows);
    require_length("zenith_residual", points.zenith_residual.size(), rows);
  }
  require_length("loading", points.loading.size(), header.factors.size());
  for (const auto& factor : points.loading) {
    for (const auto& column : factor) require_length("loading of a factor", column.size(), rows);
  }
}

/// All columns that a header announces.
inline void require_columns(const Points& points, const CloudHeader& header) {
  const std::size_t rows = points.size();
  require_computed_columns(points, header, rows);
  require_length("intensity", points.intensity.size(), rows);
  require_length("return_number", points.return_number.size(), rows);
  require_length("number_of_returns", points.number_of_returns.size(), rows);
  require_length("tag", points.tag.size(), rows);
  require_length("beam", points.beam.size(), rows);
  require_length("point_source", points.point_source.size(), header.has_point_source ? rows : 0);
}

}  // namespace risley::cloud
