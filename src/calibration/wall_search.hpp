// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "risley/calibration/plane_points.hpp"
#include "risley/calibration/plane_segmentation.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/optics/prism_train.hpp"

namespace risley::calibration {

/// How well a point is known before anything is calibrated.
struct StartNoise {
  double range = 0;     ///< 1 sigma, m
  double pointing = 0;  ///< 1 sigma of a direction that its rotation angles give it, rad
};

/// Walls in some shots of one recording, seen with optics that may still be wrong by a little. A
/// smaller plane a few sigmas off a larger one is a step of that and none of its own.
Segmentation search_walls(const RangedShots& shots, const PrismTrain& train,
                          const PrismGeometry& geometry, const StartNoise& noise,
                          std::uint64_t seed);

}  // namespace risley::calibration
