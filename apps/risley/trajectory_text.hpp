// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/jobs/inspect_trajectory.hpp"
#include "risley/trajectories/trajectory.hpp"

#include "command.hpp"

namespace risley::app {

Json warnings_json(const std::vector<trajectories::TrajectoryWarning>& warnings);
/// The same on stderr, each with the name of the file.
void log_warnings(const std::string& file,
                  const std::vector<trajectories::TrajectoryWarning>& warnings);

/// What a trajectory or a file of accuracies holds.
Json trajectory_json(const jobs::InspectedTrajectory& found);
/// The same for people, on stdout.
void print_trajectory(const jobs::InspectedTrajectory& found);

}  // namespace risley::app
