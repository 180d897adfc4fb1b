// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/cloud/georeference.hpp"
#include "risley/core/progress.hpp"
#include "risley/jobs/given.hpp"

namespace risley::jobs {

/// What says how a sensor moved.
struct PlatformFiles {
  GivenTrajectory trajectory;  ///< empty: the sensor stood still
  std::string topic;           ///< of a trajectory that is a bag of ROS; empty: its only one
  GivenMount mount;
  std::string accuracy;  ///< path of the trajectory's accuracies (SMRMSG); may be empty
  std::string errors;    ///< path of an error process; may be empty
  std::string crs;       ///< as cloud::MovingPlatform
  std::string datum;     ///< as cloud::MovingPlatform; empty: WGS 84
};

/// Whether any of them is given.
bool moves(const PlatformFiles& files);

/// The paths given, for provenance and for distinguishing outputs from inputs.
std::vector<std::string> paths_of(const PlatformFiles& files);

/// The mount that was given. @throws FileError
trajectories::Mount mount_of(const GivenMount& given);
/// The trajectory that was given. @throws as trajectories::load_trajectory()
trajectories::Trajectory trajectory_of(const GivenTrajectory& given, const std::string& topic,
                                       const Progress& progress = {});

/// @throws InvalidArgument if the trajectory or the mount is missing; FileError
cloud::MovingPlatform load_platform(const PlatformFiles& files, const Progress& progress = {});

}  // namespace risley::jobs
