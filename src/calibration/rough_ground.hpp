// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "risley/calibration/flight_adjustment.hpp"
#include "risley/calibration/ground_cells.hpp"

namespace risley::calibration {

/// Departure of the ground from its planes: the mean product of two residuals for every two patches
/// of a cell, over some cells. Nothing if chance explains all of it.
/// @param points  of the shots; with `grid`, they define the patches
std::optional<RoughGround> rough_ground(const FlightShots& shots, const ShotPoses& poses,
                                        const PlaneOfShot& plane, const ShotPoints& points,
                                        const GroundCellOptions& grid, const FlightModel& model,
                                        const FlightWeights& weights);

}  // namespace risley::calibration
