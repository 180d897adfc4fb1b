// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <limits>

namespace risley::scenes {

inline constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// Surfaces extend this far beyond their edges so that no ray slips between two of them, m.
inline constexpr double kSeam = 1e-9;

/// Interval of a ray within low to high of one axis: [enter, leave], enter > leave: nowhere.
inline void clip(double origin, double direction, double low, double high, double& enter,
                 double& leave) {
  if (direction == 0.0) {
    if (origin < low || origin > high) leave = -kInfinite;
    return;
  }
  const double a = (low - origin) / direction, b = (high - origin) / direction;
  enter = std::max(enter, std::min(a, b));
  leave = std::min(leave, std::max(a, b));
}

}  // namespace risley::scenes
