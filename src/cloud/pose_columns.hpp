// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include "risley/cloud/sensor_poses.hpp"

#include "cloud/georeference_kernel.hpp"

namespace risley::cloud {

/// Poses in the form for the kernels.
inline PoseColumns pose_columns(const SensorPoses& poses) {
  PoseColumns columns;
  for (std::size_t k = 0; k < 9; ++k) columns.turn[k] = poses.turn[k].data();
  for (std::size_t k = 0; k < 3; ++k) columns.reference[k] = poses.reference[k].data();
  std::copy_n(poses.lever_arm.data(), 3, columns.lever_arm);
  return columns;
}

}  // namespace risley::cloud
