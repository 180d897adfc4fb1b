// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "risley/estimation/angle_series.hpp"

namespace risley::estimation {

/// One line of the spectrum of y + iz, the beam's position across the axis.
struct SpectralLine {
  double angular_velocity = 0;  ///< rad/s, signed: right-handed about X is positive
  double amplitude = 0;         ///< of the unit vector's transverse part
  double phase = 0;             ///< rad, at the reference time
};

/// The two strongest lines, strongest first. To first order a prism adds a vector that turns with
/// it, so each rotor owns one line. Taken from the best covered stretch of about 80 ms (more where
/// shots are rare); shots may be missing and unevenly spaced.
struct RotorLines {
  std::int64_t time_ns = 0;  ///< reference time of the phases: the middle of the used shots
  ShotRange shots;           ///< used rows
  std::vector<SpectralLine> lines;
};

/// @throws EstimationError when the series spans less than 50 ms or has too few shots
RotorLines rotor_lines(const AngleSeries& series);

}  // namespace risley::estimation
