// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "risley/calibration/plane_points.hpp"
#include "risley/calibration/plane_segmentation.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/optics/prism_train.hpp"

namespace risley::calibration {

/// Uncertainty of a point before the calibration.
struct StartNoise {
  double range = 0;     ///< 1 sigma, m
  double pointing = 0;  ///< 1 sigma of a direction due to its rotation angles, rad
};

/// Finds walls in some shots of one recording, with optics that may still be slightly wrong. A
/// smaller plane a few sigmas off a larger one is a step of that one and not a separate plane.
Segmentation search_walls(const RangedShots& shots, const PrismTrain& train,
                          const PrismGeometry& geometry, const StartNoise& noise,
                          std::uint64_t seed);

}  // namespace risley::calibration
