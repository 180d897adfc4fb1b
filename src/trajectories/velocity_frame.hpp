// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "risley/trajectories/trajectory.hpp"

namespace risley::trajectories {

/// Axes that the velocities of a file may stand along.
enum class VelocityAxes : std::uint8_t {
  north_east_down,
  east_north_up,
  north_west_up_wander,  ///< north turned by the wander angle, as Applanix writes them
  body,                  ///< forward, right, down
  body_up,               ///< forward, left, up
  frame,                 ///< those of the trajectory itself
};

/// "north-west-up, turned by the wander angle"
std::string_view words_of(VelocityAxes axes);

/// Turns the velocities of a file, which stand in `trajectory.velocity` as they were read, into the
/// trajectory's frame, and says along which axes they stood. They are removed where that cannot be
/// told.
/// @param wander  of every row, rad; empty where the file has none
/// @param stated  what the file says of its axes; all are tried where it says nothing. What does
/// not
///                fit the positions is a warning
void settle_velocities(Trajectory& trajectory, const std::vector<double>& wander,
                       std::optional<VelocityAxes> stated);

}  // namespace risley::trajectories
