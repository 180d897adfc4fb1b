// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "risley/calibration/planar_adjustment.hpp"
#include "risley/scenes/scene.hpp"

namespace risley::calibration {

/// A plane found in one recording.
struct FoundPlane {
  std::size_t recording = 0;
  Plane plane;  ///< sensor frame
  std::size_t points = 0;
  std::size_t wall = 0;  ///< row of WallMatching::walls
  double side = 1.0;     ///< -1 if the wall was seen from behind
};

/// Which planes of which recordings are the same wall.
struct WallMatching {
  std::vector<Wall> walls;
  std::vector<StationPose> stations;  ///< [recordings]
  bool stations_known = false;
  std::vector<Warning> warnings;
};

/// Without stations and known planes every found plane is a separate wall: nothing is known of the
/// poses. Otherwise planes are compared in the scene's frame, by normal and distance, with the
/// known ones and with each other.
/// @param[in,out] found   gets its walls
/// @param recordings      names [recordings]
/// @param planes          known or named walls; those with a normal_sigma have known normals
/// @param stations        [recordings], or empty
/// @throws EstimationError when no known plane is seen, or a station shares no wall with the rest
WallMatching match_walls(std::vector<FoundPlane>& found, const std::vector<std::string>& recordings,
                         const std::optional<scenes::Scene>& planes,
                         const std::vector<scenes::Station>& stations);

}  // namespace risley::calibration
