// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/core/progress.hpp"
#include "risley/trajectories/trajectory.hpp"

namespace risley::trajectories {

/// Whether a bag holds topics of poses and none of a lidar's points.
/// @throws FileError; Cancelled
bool holds_poses_alone(const std::string& path, const Progress& progress);

/// The poses of one topic.
/// @param topic  its name; empty if the bag has only one topic of poses
/// @throws FileError; InvalidArgument if the topic has no poses, and without a name if there are
/// several; Cancelled
Trajectory read_ros_bag(const std::string& path, const std::string& topic,
                        const Progress& progress);

}  // namespace risley::trajectories
