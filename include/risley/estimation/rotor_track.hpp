// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/estimation/angle_noise.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/rotor_trajectory.hpp"

namespace risley::estimation {

/// Follows the rotors from a start through a stretch, 25 ms at a time with the start's optics,
/// which gives every knot of it angles and speeds to a degree or so. A gap, or a window with few
/// shots in a corner of the field, only makes the next prediction longer.
/// @param series   thinned, in the sensor's frame
/// @param shots    the stretch's rows
/// @param start    of this stretch
/// @param noise    of the shots, roughly
/// @param[in,out] knots   of the series; states of knots [first, last) are filled
void track_rotors(const AngleSeries& series, ShotRange shots, const Start& start,
                  const AngleNoise& noise, RotorTrajectory& knots, std::size_t first,
                  std::size_t last);

}  // namespace risley::estimation
