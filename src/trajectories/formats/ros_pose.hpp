// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Messages of ROS with a pose: nav_msgs Odometry, geometry_msgs PoseStamped,
// PoseWithCovarianceStamped and TransformStamped.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "risley/bags/bag.hpp"

namespace risley::trajectories {

/// One message. Frames have axes x forward or east, y left or north, z up.
struct RosPose {
  std::int64_t time_ns = 0;  ///< of the header
  std::string frame, body;   ///< names; a pose without a body's name has none
  Eigen::Vector3d position{0, 0, 0};
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();  ///< frame from body, unit length
  /// Of x, y, z and of rotations about the frame's three axes, m^2, m rad and rad^2.
  std::optional<Eigen::Matrix<double, 6, 6>> covariance;
  std::optional<Eigen::Vector3d> velocity;  ///< along the body's axes, m/s
};

/// Whether messages of a kind hold poses.
bool holds_pose(bags::MessageKind kind);

/// @throws BadMessage for a message that is too short or too long, and for an invalid pose;
/// covariances and velocities may hold anything
RosPose decode_ros_pose(bags::Serialisation serialisation, bags::MessageKind kind,
                        std::span<const std::uint8_t> bytes);

}  // namespace risley::trajectories
