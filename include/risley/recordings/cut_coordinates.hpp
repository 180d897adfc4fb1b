// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "risley/core/direction.hpp"

namespace risley::recordings {

/// The middle of the possible positions of a point whose coordinates were truncated towards zero to
/// whole steps: every coordinate but 0 is half a step further from zero.
inline Vector3<double> middle_of_cut(const Vector3<double>& point, double step) {
  const auto moved = [step](double c) {
    return std::abs(c) < 0.5 * step ? c : c + std::copysign(0.5 * step, c);
  };
  return {moved(point.x), moved(point.y), moved(point.z)};
}

/// The same of a point at a range of 1.
/// @param step            of the coordinates over the point's range
/// @param azimuth,zenith  rad, replaced
/// @return range of the middle over that of the point
inline double move_to_middle_of_cut(double step, double& azimuth, double& zenith) {
  const Vector3<double> middle =
      middle_of_cut(direction_from_angles<double>({azimuth, zenith}), step);
  const auto angles = angles_from_direction(middle);
  azimuth = angles.azimuth;
  zenith = angles.zenith;
  return norm(middle);
}

}  // namespace risley::recordings
