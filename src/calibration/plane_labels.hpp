// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "calibration/scanned_points.hpp"

namespace risley::calibration {

/// Part of a smaller plane's points that lies near a larger one where both are one surface: some of
/// the rest are outliers. PlaneSegmentation.OneSurfaceIsOnePlane
inline constexpr double kOneSurfaceShare = 0.9;

/// Planes and the points that are theirs.
struct LabelledPlanes {
  std::vector<Plane> planes;
  std::vector<int> label;              ///< [points], row of planes, -1 for clutter
  std::vector<unsigned char> at_edge;  ///< [points], whether noise decides between two planes
  bool narrow = false;                 ///< some filled no area and were dropped
};

/// Every point to the plane that it is nearest to, and fits, in turn until no label changes. Planes
/// that are none after all are dropped, and those that are one surface become one.
LabelledPlanes label_planes(const ScannedPoints& points, std::vector<Plane> planes);

}  // namespace risley::calibration
