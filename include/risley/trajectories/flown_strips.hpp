// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "risley/trajectories/interpolation.hpp"

namespace risley::trajectories {

/// A stretch of a flight along one course.
struct FlownStrip {
  std::int64_t begin_ns = 0, end_ns = 0;  ///< in the trajectory's time, both included
  double course = 0;                      ///< of the way over ground, clockwise from north, rad
  double length = 0;                      ///< m
};

/// What counts as a strip.
struct FlownStripOptions {
  /// Largest difference of courses, and of headings, within a strip, rad: 20 degrees.
  double widest_course = 0.349065850398866;
  double slowest_share = 0.5;  ///< of the median speed
  double shortest_s = 10;      ///< s
};

/// The strips of a flight in the order of time: stretches in which neither the path nor the body of
/// the platform turns. Course and speed are taken over a second, so that vibration does not matter.
/// @throws InvalidArgument for options not above 0
std::vector<FlownStrip> flown_strips(const Interpolation& interpolation,
                                     const FlownStripOptions& options = {});

}  // namespace risley::trajectories
