// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "risley/core/plane.hpp"
#include "risley/scenes/terrain.hpp"

namespace risley::scenes {

/// One flat surface, seen from both sides. Its foot is the point nearest to the scene's origin. Its
/// horizontal axis is Z x normal, to the left for a wall ahead, (-sin azimuth, cos azimuth, 0) also
/// where the normal is vertical; its vertical axis is normal x horizontal axis, upwards for a wall.
struct ScenePlane {
  std::string name;
  Plane plane;
  Vector3<double> horizontal_axis, vertical_axis;  ///< unit vectors within the plane
  /// Width along the horizontal and height along the vertical axis, m; an endless plane without.
  std::optional<std::array<double, 2>> extent;
  std::array<double, 2> center{0.0, 0.0};  ///< middle of the extent from the foot, same axes, m
  std::optional<double> normal_sigma;      ///< how well the normal is known, rad
};

/// A pose of the sensor in the scene.
struct Station {
  std::string name;
  Vector3<double> position;             ///< m
  double roll = 0, pitch = 0, yaw = 0;  ///< rad: first about X, then Y, then Z of the scene
  double sigma = 0;                     ///< how well each angle is known, rad

  /// A direction of the sensor's frame in the scene's frame: Rz(yaw) Ry(pitch) Rx(roll).
  Vector3<double> scene_from_sensor(const Vector3<double>& direction) const;
};

/// What stands around: planes around the origin, or a terrain on a map, or both; and the places
/// where the sensor stands.
struct Scene {
  std::vector<ScenePlane> planes;
  std::vector<Station> stations;
  std::optional<Terrain> terrain = {};

  /// The station of that name; for an empty name the sensor at the origin, X forward.
  /// @throws InvalidArgument that lists the known stations
  Station station(std::string_view name) const;

  /// Number of surfaces: the planes in their order, then those of the terrain in theirs.
  std::size_t surfaces() const;
  /// Name of a plane or of a surface of the terrain.
  /// @throws InvalidArgument for a surface that there is not
  std::string surface_name(std::size_t surface) const;
};

/// The nearest surface in front of a ray, or nothing: planes and faces within kFarthestHit, ground
/// with relief within kFarthestGround.
/// @param origin       scene frame, m
/// @param direction    unit vector, scene frame
/// @param penetration  how much of its way through a bush the ray gets, (0, 1)
/// @throws InvalidArgument for an origin that is not finite, a direction that is no unit vector or
///         a penetration that is not between 0 and 1
std::optional<Hit> nearest_hit(const Scene& scene, const Vector3<double>& origin,
                               const Vector3<double>& direction, double penetration = 0.5);

/// Reads planes: [{name, distance_m, normal_azimuth_deg, normal_zenith_deg, extent_m, center_m,
/// sigma_deg}], of which the last three are optional, and stations: [{name, position_m, roll_deg,
/// pitch_deg, yaw_deg, sigma_deg}], of which all but the name are, and terrain: {origin, ground,
/// roofs, buildings, bushes, village}, see docs/files.md. Each may be absent.
/// @param path  for messages only
/// @throws FileError with the line for anything else
Scene parse_scene(const std::string& text, const std::string& path);

/// parse_scene of a file. @throws FileError
Scene load_scene(const std::string& path);

}  // namespace risley::scenes
