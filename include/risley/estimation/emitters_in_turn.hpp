// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "risley/estimation/angle_series.hpp"

namespace risley::estimation {

/// A recording whose times were counted from the numbers of its shots.
struct CountedShots {
  AngleSeries series;             ///< all valid shots, as recorded
  std::vector<std::size_t> rows;  ///< observation of each, counted from 0 over all rows
  double shot_rate = 0;           ///< that they were counted with, Hz
  bool in_turn = false;           ///< the file names no emitters: they are assumed to fire in turn
};

/// Emitters that fire in turn, up to the largest known number: shots of one emitter follow each
/// other as smoothly as those of a single one.
int emitters_in_turn(const CountedShots& shots);

/// Number of rows between two places where the beam of an emitter jumps or turns faster than rotors
/// can move it; infinite if it does not, or if there are too few shots to decide. @param emitters
/// of the sensor, which fire in turn
double rows_between_jumps(const CountedShots& shots, int emitters);

}  // namespace risley::estimation
