// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "risley/core/vector3.hpp"

namespace risley::scenes {

/// A measured circle of ground: a point of it, and possibly its inclination.
struct KnownGround {
  std::string name;
  Vector3<double> place;  ///< on it, m
  double sigma = 0.01;    ///< of the place along the ground's normal, 1 sigma, m
  double radius = 1;      ///< of the level circle about the place within which it is one plane, m
  std::optional<Vector3<double>> normal;  ///< unit vector, upwards
  double normal_sigma = 0;                ///< of each of its two tilts, 1 sigma, rad
};

/// Known ground on a map, or in the frame of a trajectory without a map.
struct Control {
  std::string crs;    ///< of the places, as cloud::MapProjection; empty: the trajectory's frame
  std::string datum;  ///< of the trajectory's positions; empty: WGS 84
  std::vector<KnownGround> ground;
};

/// @throws InvalidArgument for non-finite numbers, sigmas and radii not above 0, normals that are
/// not unit vectors
void require_known_ground(const KnownGround& ground);

/// Reads risley_control: 1, crs, datum (optional), ground: [{name, place_m, sigma_m, radius_m,
/// normal_azimuth_deg, normal_zenith_deg, normal_sigma_deg}], see docs/files.md.
/// @param path  for messages only
/// @throws FileError with the line for anything else
Control parse_control(const std::string& text, const std::string& path);

/// parse_control of a file. @throws FileError
Control load_control(const std::string& path);

}  // namespace risley::scenes
