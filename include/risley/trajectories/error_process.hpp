// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>

namespace risley::trajectories {

/// stand-in until the real one
struct ErrorProcess {
  std::array<double, 6> sigma{};             ///< shifts north, east, down, m; rotations, rad
  std::array<double, 6> correlation_time{};  ///< s
  double white_rotation = 0, sample_interval = 0;
};

}  // namespace risley::trajectories
