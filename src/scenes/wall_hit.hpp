// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "risley/scenes/scene.hpp"

namespace risley::scenes {

/// Hit of a ray on one wall.
struct WallHit {
  double range = 0;        ///< m
  Vector3<double> normal;  ///< unit vector, on either side
  double reflectivity = 0;
  bool glass = false;
};

/// Whether a wall is a flat surface of one kind, as most are.
inline bool is_plain(const ScenePlane& wall) {
  return wall.patches.empty() && !wall.glass && wall.shape.flat();
}

/// The nearest point of a wall with its waves, bow and steps in front of a ray, or nothing. Rays
/// that stay near an almost parallel wall for more than some thousand half waves end nowhere.
/// @param farthest  that is of interest, m
std::optional<WallHit> meet_wall(const ScenePlane& wall, const Vector3<double>& origin,
                                 const Vector3<double>& direction, double farthest);

}  // namespace risley::scenes
