// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "risley/scenes/scene.hpp"

#include "calibration/wall_matching.hpp"

namespace risley::calibration {

/// How recordings stood to each other if they saw the same walls.
struct FoundPoses {
  /// [recordings], with sigmas of infinity; empty where they cannot be found.
  std::vector<scenes::Station> stations;
  std::size_t reference = 0;  ///< recording whose frame is the scene's
  std::string why_not;        ///< in words, where there are none
};

/// Looks for the turns, and shifts of up to half a metre, that lay the planes of all recordings on
/// those of one of them. Two walls that are not parallel fix a turn; where another turn fits as
/// well, as in a square room, there is no answer.
/// @param found       planes of all recordings
/// @param recordings  names
FoundPoses poses_before_same_walls(const std::vector<FoundPlane>& found,
                                   const std::vector<std::string>& recordings);

}  // namespace risley::calibration
