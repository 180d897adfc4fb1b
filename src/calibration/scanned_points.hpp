// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "calibration/direction_grid.hpp"
#include "calibration/point_noise.hpp"

namespace risley::calibration {

/// The points in which planes are searched.
struct ScannedPoints {
  ScannedPoints(std::vector<Beam> all, const SegmentationOptions& settings)
      : options(settings),
        noise(settings, 1.0),
        beams(std::move(all)),
        grid(beams),
        needed(std::max({std::size_t{3}, settings.least_points,
                         static_cast<std::size_t>(std::ceil(
                             settings.least_fraction * static_cast<double>(beams.size())))})) {}

  bool too_narrow(const std::vector<std::size_t>& rows) const {
    return grid.shorter_extent(rows) < options.least_extent;
  }

  const SegmentationOptions& options;
  PointNoise noise;
  std::vector<Beam> beams;
  DirectionGrid grid;
  std::size_t needed;  ///< points of a plane
};

}  // namespace risley::calibration
