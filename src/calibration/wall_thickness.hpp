// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "risley/calibration/calibrate.hpp"

#include "calibration/labelled_shots.hpp"

namespace risley::calibration {

/// Thickness of the walls' points with the believed parameters and with the adjusted ones.
struct WallThickness {
  std::vector<CalibratedPlane> planes;  ///< [views]
  std::vector<ThicknessProfile> profiles;
  double rms_before = 0, rms_after = 0;  ///< over all planes, m
  std::size_t points = 0;
};

/// @param solution    of the problem
/// @param believed  with which the sensor computed directions
/// @param recordings  [recordings], with labels
WallThickness wall_thickness(const PlanarSolution& solution, const PrismTrain& believed,
                             const std::vector<LabelledShots>& recordings);

}  // namespace risley::calibration
