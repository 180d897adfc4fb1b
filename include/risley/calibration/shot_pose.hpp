// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

namespace risley::calibration {

/// Pose and motion of the body at a shot, in the axes of a local frame.
struct ShotPose {
  double position[3];         ///< m
  double attitude[4];         ///< local from body, a unit quaternion w, x, y, z
  float velocity[3];          ///< over a tenth of a second, m/s
  float angular_velocity[3];  ///< local axes, rad/s
};

}  // namespace risley::calibration
