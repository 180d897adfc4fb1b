// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "risley/cloud/sensor_pose.hpp"

#include "cloud/plain_poses.hpp"

namespace risley::cloud {

/// Poses, at least one, as the kernels read them.
inline PlainPoses plain_poses(std::span<const SensorPose> poses) {
  static_assert(sizeof(SensorPose) % sizeof(double) == 0);
  const SensorPose& first = poses.front();
  return {first.turn.data(),     first.reference.data(), first.lever.data(),
          first.velocity.data(), first.rate.data(),      sizeof(SensorPose) / sizeof(double)};
}

}  // namespace risley::cloud
