// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "risley/scenes/scene.hpp"

#include "calibration/wall_matching.hpp"

namespace risley::calibration {

/// Relative poses of recordings of the same walls.
struct FoundPoses {
  /// [recordings], with sigmas of infinity; empty if they cannot be found.
  std::vector<scenes::Station> stations;
  std::size_t reference = 0;  ///< recording whose frame is the scene's
  std::string why_not;        ///< reason, if there are none
};

/// Searches the rotations, and shifts of up to half a metre, that align the planes of all
/// recordings with those of one of them. Two walls that are not parallel fix a rotation; if another
/// rotation fits as well, as in a square room, there is no result.
/// @param found       planes of all recordings
/// @param recordings  names
FoundPoses poses_before_same_walls(const std::vector<FoundPlane>& found,
                                   const std::vector<std::string>& recordings);

}  // namespace risley::calibration
