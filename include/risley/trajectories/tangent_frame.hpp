// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "risley/trajectories/trajectory.hpp"

namespace risley::trajectories {

/// Axes of a map at one place: x east, y north, z up. Small coordinates and a level plane for
/// adjustments, without the scale and the rotation of a projection.
struct TangentFrame {
  Frame frame = Frame::local;                          ///< of the trajectory it belongs to
  Eigen::Vector3d origin{0, 0, 0};                     ///< in that frame, m
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< its unit vectors there, as columns
};

/// The tangent frame in the middle of a trajectory's positions.
/// @throws InvalidArgument as require_trajectory
TangentFrame tangent_frame(const Trajectory& trajectory);

/// A trajectory among the axes of a tangent frame: a local one.
/// @throws InvalidArgument as require_trajectory, and for a trajectory of another frame
Trajectory in_tangent_frame(const Trajectory& trajectory, const TangentFrame& tangent);

/// The inverse. @throws InvalidArgument as in_tangent_frame
Trajectory from_tangent_frame(const Trajectory& trajectory, const TangentFrame& tangent);

}  // namespace risley::trajectories
