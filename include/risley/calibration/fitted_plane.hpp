// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>

#include "risley/core/plane.hpp"
#include "risley/core/vector3.hpp"

namespace risley::calibration {

/// Plane that fits points best (smallest singular value), its normal away from the origin.
/// @param use  rows of the points
/// @throws EstimationError when there are fewer than three points or they lie on one line;
/// InvalidArgument for a row that does not exist
Plane fitted_plane(std::span<const Vector3<double>> points, std::span<const std::size_t> use);

}  // namespace risley::calibration
