// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/jobs/inspect_trajectory.hpp"
#include "risley/trajectories/trajectory.hpp"

namespace risley::app {

/// Prints the contents of a trajectory or a file of accuracies.
void print_trajectory(const jobs::InspectedTrajectory& found);

}  // namespace risley::app
