// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <Eigen/Core>

#include "risley/estimation/angle_series.hpp"

namespace risley::estimation {

/// How coordinates became whole steps.
enum class CoordinateRounding {
  unknown,      ///< no coordinates, or undecided by the data
  nearest,      ///< to the nearest step
  toward_zero,  ///< truncated: every coordinate is half a step too small on average
};

/// "unknown", "nearest" or "toward zero".
std::string to_string(CoordinateRounding rounding);

/// Adds half a step away from zero to the coordinates of every shot: the mean effect of truncation.
/// Directions and ranges change.
/// @param series                 with ranges and the rounding variances of Cartesian records
/// @param recording_from_sensor  from the series' frame to the one in which the coordinates were
/// truncated
void add_half_steps(AngleSeries& series, const Eigen::Matrix3d& recording_from_sensor);

/// Shift of the directions of such a series, in sigmas of all shots together: below 5 or so the two
/// ways of rounding cannot be distinguished.
/// @param noise  of the angles beside the rounding, 1 sigma, rad
double half_step_signal(const AngleSeries& series, double noise);

}  // namespace risley::estimation
