// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "risley/core/direction.hpp"

namespace risley::recordings {

/// The middle of where a point was whose coordinates were cut off towards zero at whole steps:
/// every coordinate but 0 is half a step further from zero.
/// @param step            of the coordinates over the point's range
/// @param azimuth,zenith  rad, replaced
/// @return range of the middle over that of the point
inline double move_to_middle_of_cut(double step, double& azimuth, double& zenith) {
  const auto v = direction_from_angles<double>({azimuth, zenith});
  const auto moved = [step](double c) {
    return std::abs(c) < 0.5 * step ? c : c + std::copysign(0.5 * step, c);
  };
  const double x = moved(v.x), y = moved(v.y), z = moved(v.z);
  azimuth = std::atan2(y, x);
  zenith = std::atan2(std::hypot(x, y), z);
  return std::sqrt(x * x + y * y + z * z);
}

}  // namespace risley::recordings
