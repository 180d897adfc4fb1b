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

/// All columns are as a header announces them, with this many rows or none.
inline void require_columns(const Points& points, const CloudHeader& header, std::size_t rows) {
  require_length("rotation_angle", points.rotation_angle.size(),
                 header.has_rotation_angles ? header.prisms : 0);
  require_length("loading", points.loading.size(), header.factors.size());
  for_each_point_column(points, [&](const PointColumn& entry, const auto& column) {
    require_length(entry.variable.substr(0, entry.variable.find("_{")), column.size(),
                   header.announces(entry) ? rows : 0);
  });
}

}  // namespace risley::cloud
