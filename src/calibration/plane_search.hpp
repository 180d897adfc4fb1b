// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "calibration/scanned_points.hpp"

namespace risley::calibration {

/// Candidates for planes.
struct FoundCandidates {
  std::vector<Plane> planes;
  bool narrow = false;  ///< some fill no area and were set aside
};

/// RANSAC: the largest plane, fitted to its points, then the next one among the unexplained points.
FoundCandidates search_planes(const ScannedPoints& points);

}  // namespace risley::calibration
