// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include <Eigen/Core>

namespace risley::cloud {

/// Where a sensor is at the time of a shot, in the trajectory's frame.
struct SensorPose {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  ///< frame from sensor
  Eigen::Vector3d reference{0, 0, 0};                  ///< the trajectory's reference point, m
  Eigen::Vector3d lever{0, 0, 0};                      ///< from there to the sensor's origin, m
  Eigen::Vector3d velocity{0, 0, 0};  ///< of the reference point, to some milliseconds, m/s
  Eigen::Vector3d rate{0, 0, 0};      ///< of turning, to some milliseconds, rad/s
  std::uint16_t strip = 0;            ///< from 1; 0: of none
};

}  // namespace risley::cloud
