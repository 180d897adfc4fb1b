// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "risley/optics/beam_origin.hpp"
#include "risley/optics/prism_train.hpp"

namespace risley {

/// Offset of the beam's origin from the frame's, over the field of view: every direction is reached
/// with several sets of rotation angles, each with its own origin. [B21 App. A, Fig. A1]
struct BeamOriginMap {
  double cell = 0;                      ///< side of a cell, rad
  std::vector<double> azimuth, zenith;  ///< middle of the cells with a beam, rad
  /// Least and greatest Y and Z of the origins of a cell's beams, m [cells].
  std::vector<double> least_y, greatest_y, least_z, greatest_z;
  std::size_t beams = 0;  ///< that got through the prisms

  std::size_t size() const { return azimuth.size(); }
};

/// Sends beams of every emitter at all combinations of `steps` rotation angles of two prisms
/// through the train; with more prisms as many beams, their angles spread evenly by a
/// low-discrepancy sequence.
/// @param steps  per turn; the paper's grid of 0.333 degree has 1,081, both ends included
/// @throws InvalidArgument for steps below 2 or a cell not above 0; as check_shape() and
/// face_positions()
BeamOriginMap beam_origin_map(const PrismTrain& train, const PrismGeometry& geometry,
                              std::size_t steps, double cell);

}  // namespace risley
