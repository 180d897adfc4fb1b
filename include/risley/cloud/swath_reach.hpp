// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/sensors/sensor.hpp"
#include "risley/trajectories/mount.hpp"

namespace risley::cloud {

/// How far the beams of a level platform reach from the place below it, per metre of height above
/// ground. Negative on a side that they do not reach.
struct SwathReach {
  double left = 0, right = 0, ahead = 0, behind = 0;
};

/// The reach of a sensor's whole field of view on a mount.
/// @throws InvalidArgument as require_mount, for a sensor without prisms, and if a beam points less
/// than 10 degrees below the horizon
SwathReach swath_reach(const sensors::Sensor& sensor, const trajectories::Mount& mount);

}  // namespace risley::cloud
