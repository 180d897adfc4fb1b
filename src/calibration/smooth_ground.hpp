// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/flight_equations.hpp"

namespace risley::calibration {

/// Information of the shots on the two tilts of every plane, for any offset.
std::vector<Eigen::Matrix2d> tilt_information(std::size_t planes, const FlightEquations& equations);

/// Planes that differ from their surroundings only by noise are aligned with them: a cell that
/// leans by chance would suggest shifts across it that its shots do not support.
/// docs/theory/flight.md
/// @param information  of the tilts of every plane
std::vector<GroundPlane> smooth_ground(const std::vector<GroundPlane>& planes,
                                       const std::vector<Eigen::Matrix2d>& information);

}  // namespace risley::calibration
