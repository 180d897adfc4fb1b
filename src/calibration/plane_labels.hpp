// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "calibration/scanned_points.hpp"

namespace risley::calibration {

/// Share of a smaller plane's points that lies near a larger one if both are one surface: some of
/// the rest are outliers. PlaneSegmentation.OneSurfaceIsOnePlane
inline constexpr double kOneSurfaceShare = 0.9;

/// Planes and their points.
struct LabelledPlanes {
  std::vector<Plane> planes;
  std::vector<int> label;              ///< [points], row of planes, -1 for clutter
  std::vector<unsigned char> at_edge;  ///< [points], whether noise decides between two planes
  bool narrow = false;                 ///< some filled no area and were dropped
};

/// Alternates assigning every point to its nearest plane, and fits, until no label changes. Invalid
/// planes are dropped, and planes of one surface are merged.
LabelledPlanes label_planes(const ScannedPoints& points, std::vector<Plane> planes);

}  // namespace risley::calibration
