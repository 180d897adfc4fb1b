// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "risley/trajectories/trajectory.hpp"

namespace risley::trajectories {

/// Possible axes of a file's velocities.
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

/// Rotates the velocities of a file, which are in `trajectory.velocity` as read, into the
/// trajectory's frame, and returns their original axes. They are removed if the axes remain
/// unclear.
/// @param wander  of every row, rad; empty if the file has none
/// @param stated  the file's statement on its axes; all are tried if there is none. A misfit with
/// the positions gives a warning
void settle_velocities(Trajectory& trajectory, const std::vector<double>& wander,
                       std::optional<VelocityAxes> stated);

}  // namespace risley::trajectories
