// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

#include "risley/identification/shot_grid.hpp"

namespace risley::identification {

/// A position across the axis, y + iz.
using Complex = std::complex<double>;

/// One line of the spectrum of y + iz: a rotating vector in the unit sphere's tangent plane.
struct Line {
  double angular_velocity = 0;  ///< rad/s, signed: right-handed about X is positive
  Complex amplitude;            ///< at the grid's time 0
};

/// The spectrum of a scan: constants, lines, and the change of the constants from shot to shot.
struct LineSpectrum {
  std::vector<Line> lines;        ///< strongest first
  std::vector<Complex> constant;  ///< of every emitter: the mean position of its beams
  double unexplained = 0;         ///< mean square of the remainder, of the unit vector
};

/// What to look for.
struct LineSpectrumOptions {
  double fastest = 0;    ///< no line turns faster, rad/s
  std::size_t most = 8;  ///< lines
};

/// y + iz of every shot.
std::vector<Complex> transverse(const ShotGrid& grid);

/// Emitters that fire in turn appear as constants that repeat every so many slots: the shortest
/// such period, 1 if there is none. The lines are removed first, since a few of them would appear
/// as a weak pattern of any period.
/// @param grid  one emitter, or as named in the recording
int emitter_period(const ShotGrid& grid, const std::vector<Line>& lines);

/// The strongest lines, one after another, with a joint fit of all of them each time, at the times
/// with shots. docs/theory/identify.md
/// @param grid  with the emitter of every shot
LineSpectrum line_spectrum(const ShotGrid& grid, const LineSpectrumOptions& options);

}  // namespace risley::identification
