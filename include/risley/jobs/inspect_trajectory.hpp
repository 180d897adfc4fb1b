// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/trajectories/trajectory.hpp"
#include "risley/trajectories/trajectory_audit.hpp"

namespace risley::jobs {

/// What to look at.
struct InspectTrajectoryOptions {
  std::string trajectory;  ///< path of a trajectory, or of accuracies (SMRMSG) alone
  std::string accuracy;    ///< path of the accuracies of the trajectory; empty: those that it holds
  std::string topic;       ///< of a bag of ROS; empty: its only one with poses
};

/// Whether to read an input that may be a recording as a trajectory: a file of one, or a bag with a
/// named topic of poses.
/// @param reading  options that only recordings have
/// @throws InvalidArgument for options of the other kind; FileError
bool is_trajectory(const InspectTrajectoryOptions& options, const recordings::ReadOptions& reading,
                   const Progress& progress = {});

/// Contents of a file of poses or accuracies.
struct InspectedTrajectory {
  std::optional<trajectories::Trajectory> trajectory;     ///< nothing where accuracies were given
  std::optional<trajectories::TrajectoryAudit> audit;     ///< of the trajectory
  std::optional<trajectories::AccuracyAudit> accuracies;  ///< of the file of accuracies
  /// Of everything that was read.
  std::vector<Warning> warnings;
};

/// Reads a trajectory and audits it. Stages: reading, checking.
/// @throws FileError; InvalidArgument for accuracies of accuracies; Cancelled
InspectedTrajectory inspect_trajectory(const InspectTrajectoryOptions& options,
                                       const Progress& progress = {});

}  // namespace risley::jobs
