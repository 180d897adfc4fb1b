// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "risley/trajectories/error_process.hpp"
#include "risley/trajectories/flight_plan.hpp"
#include "risley/trajectories/geodesy.hpp"
#include "risley/trajectories/mount.hpp"
#include "risley/trajectories/trajectory.hpp"

namespace risley::simulation {

/// The true carrier of a moving sensor. A shot with time c on the recording's clock is fired at the
/// trajectory's time
///
///     t = c + clock_offset + clock_drift (c - c_0)
///
/// with the clock offset of the mount and the clock's reading c_0 at the first shot, and a point p
/// of the sensor's frame is then at r(t) + R(t) (lever_arm + nominal boresight p). Poses between
/// records are those of trajectories::Interpolation.
struct Platform {
  std::shared_ptr<const trajectories::Trajectory> trajectory;  ///< not null
  trajectories::Mount mount;
  double clock_drift = 0;  ///< gain of the trajectory's time on the recording's clock, s/s
  /// Time of the trajectory at which the recording begins; empty: at its first record. The clock
  /// begins with the next whole millisecond, and not before 0.
  std::optional<std::int64_t> begin_ns;
  /// Where x = y = z = 0 of the scene is on the Earth, its axes east, north and up there; empty:
  /// where its terrain says. A local trajectory has the scene's axes.
  std::optional<trajectories::Geodetic> map_origin;

  // The part of it written beside the recording; shots do not depend on it.
  std::optional<trajectories::ErrorModel> errors;  ///< of the trajectory that the user gets
  std::string trajectory_ending = ".csv";          ///< of its file, which selects the format
  std::vector<trajectories::StripTimes> strips;    ///< of the flight; may be empty
};

/// Reading of the recording's clock at its first shot, ns.
/// @throws InvalidArgument for a platform without trajectory or mount, or a drift beyond 1e-3
std::int64_t first_clock_reading_ns(const Platform& platform);

/// The longest recording, s, covered by poses of the trajectory, ignoring gaps. 0: none.
/// @throws InvalidArgument as first_clock_reading_ns
double longest_duration(const Platform& platform);

}  // namespace risley::simulation
