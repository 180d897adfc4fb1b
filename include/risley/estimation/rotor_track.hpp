// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/rotor_trajectory.hpp"

namespace risley::estimation {

/// Follows the phases of both spectral lines through a stretch, 25 ms at a time, and so gives every
/// knot of it angles and speeds that are right to a degree or so, without a model of the rotors,
/// over gaps and among outliers.
/// @param series   thinned to about 1 kHz
/// @param shots    the stretch's rows
/// @param start    of this stretch
/// @param[in,out] knots   of the series; states of knots [first, last) are filled
void track_rotors(const AngleSeries& series, ShotRange shots, const Start& start,
                  RotorTrajectory& knots, std::size_t first, std::size_t last);

}  // namespace risley::estimation
