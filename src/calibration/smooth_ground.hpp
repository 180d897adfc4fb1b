// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/flight_equations.hpp"

namespace risley::calibration {

/// What the shots say about the two tilts of every plane, whatever its offset.
std::vector<Eigen::Matrix2d> tilt_information(std::size_t planes, const FlightEquations& equations);

/// Planes that lean as their surroundings do, but for noise, made to lean just so: a cell that
/// leans by chance would suggest shifts across it, and its shots do not follow.
/// docs/theory/flight.md
/// @param information  of the tilts of every plane
std::vector<GroundPlane> smooth_ground(const std::vector<GroundPlane>& planes,
                                       const std::vector<Eigen::Matrix2d>& information);

}  // namespace risley::calibration
