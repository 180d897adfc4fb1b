// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/tangent_frame.hpp"

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley::trajectories {
namespace {

void require_frame(const Trajectory& trajectory, Frame frame) {
  require_trajectory(trajectory);
  if (trajectory.frame == frame) return;
  throw InvalidArgument(
      fmt::format("frame = {}, expected {}", to_string(trajectory.frame), to_string(frame)));
}

/// Rotates everything about the origin; the caller handles positions.
void turn(Trajectory& trajectory, const Eigen::Matrix3d& rotation) {
  const Eigen::Quaterniond quaternion(rotation);
  for (Eigen::Quaterniond& attitude : trajectory.attitude) {
    attitude = (quaternion * attitude).normalized();
  }
  for (Eigen::Vector3d& velocity : trajectory.velocity) velocity = rotation * velocity;
}

}  // namespace

TangentFrame tangent_frame(const Trajectory& trajectory) {
  require_trajectory(trajectory);
  const Eigen::Vector3d& first = trajectory.position.front();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& position : trajectory.position) sum += position - first;
  TangentFrame tangent;
  tangent.frame = trajectory.frame;
  tangent.origin = first + sum / static_cast<double>(trajectory.size());
  const Eigen::Matrix3d ned = ned_axes(trajectory.frame, tangent.origin);
  tangent.axes << ned.col(1), ned.col(0), -ned.col(2);
  return tangent;
}

Trajectory in_tangent_frame(const Trajectory& trajectory, const TangentFrame& tangent) {
  require_frame(trajectory, tangent.frame);
  Trajectory local = trajectory;
  local.frame = Frame::local;
  const Eigen::Matrix3d back = tangent.axes.transpose();
  for (Eigen::Vector3d& position : local.position) position = back * (position - tangent.origin);
  turn(local, back);
  return local;
}

Trajectory from_tangent_frame(const Trajectory& trajectory, const TangentFrame& tangent) {
  require_frame(trajectory, Frame::local);
  Trajectory result = trajectory;
  result.frame = tangent.frame;
  for (Eigen::Vector3d& position : result.position) {
    position = tangent.origin + tangent.axes * position;
  }
  turn(result, tangent.axes);
  return result;
}

}  // namespace risley::trajectories
