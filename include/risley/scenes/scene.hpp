// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "risley/core/plane.hpp"
#include "risley/scenes/furniture.hpp"
#include "risley/scenes/terrain.hpp"
#include "risley/scenes/wall_shape.hpp"

namespace risley::scenes {

/// A rectangle of a wall that stands before or behind it, or is of another material: a door, a
/// window with its reveal, a board of known thickness, a dark stripe.
struct Patch {
  std::string name;                        ///< may be empty
  std::array<double, 2> center{0.0, 0.0};  ///< from the plane's foot, along its axes, m
  std::array<double, 2> size{0.0, 0.0};    ///< width and height, m
  double depth = 0;  ///< behind the wall around it, away from the scene's origin, m
  std::optional<double> reflectivity;  ///< (0, 1]; empty: the wall's
  bool glass = false;                  ///< as ScenePlane::glass
};

/// Most patches of one wall.
inline constexpr std::size_t kMostPatches = 64;

/// A pane mirrors: it gives a return where the angle of incidence is at most this, rad. Assumed.
inline constexpr double kGlassReturnAngle = 0.01;
/// Share of the light that remains on the way to a target behind a pane and back. Assumed: 8 % are
/// lost at the two faces of a pane, on each way.
inline constexpr double kGlassTransmission = 0.85;

/// One surface, seen from both sides: flat, or with a shape and patches. Its foot is the point
/// nearest to the scene's origin. Its horizontal axis is Z x normal, to the left for a wall ahead,
/// (-sin azimuth, cos azimuth, 0) also where the normal is vertical; its vertical axis is normal x
/// horizontal axis, upwards for a wall.
struct ScenePlane {
  std::string name;
  Plane plane;
  Vector3<double> horizontal_axis, vertical_axis;  ///< unit vectors within the plane
  /// Width along the horizontal and height along the vertical axis, m; an endless plane without.
  std::optional<std::array<double, 2>> extent;
  std::array<double, 2> center{0.0, 0.0};   ///< middle of the extent from the foot, same axes, m
  std::optional<double> normal_sigma;       ///< how well the normal is known, rad
  double reflectivity = kMattReflectivity;  ///< (0, 1] Whether rays pass through it, except those
                                            ///< that it mirrors back to the sensor.
  bool glass = false;
  WallShape shape;             ///< its deviation from the plane without steps
  std::vector<Patch> patches;  ///< steps and materials; the last one counts where they overlap
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

/// Surroundings of a sensor: planes and furniture around the origin, or a terrain on a map, or
/// both; and the stations of the sensor.
struct Scene {
  std::vector<ScenePlane> planes;
  std::vector<Station> stations;
  std::optional<Terrain> terrain = {};
  std::vector<SceneBox> boxes = {};
  std::vector<Person> people = {};
  /// Whether simulated beams are as wide as stated for the sensor, so that shots on edges meet
  /// several surfaces, or lines.
  bool footprint = false;
  /// Whether dark and tilted surfaces give no return at ranges at which a bright one does.
  bool limit_by_reflectivity = false;

  /// The station of that name; for an empty name the sensor at the origin, X forward.
  /// @throws InvalidArgument that lists the known stations
  Station station(std::string_view name) const;

  /// Number of surfaces: the planes in their order, then those of the terrain in theirs, then
  /// boxes and people.
  std::size_t surfaces() const;
  /// Name of a plane, of a surface of the terrain, of a box or of a person.
  /// @throws InvalidArgument for a surface that does not exist
  std::string surface_name(std::size_t surface) const;
};

/// The nearest surface in front of a ray, or nothing: planes and faces within kFarthestHit, ground
/// with relief within kFarthestGround. Rays pass through glass unless it mirrors them back.
/// @param origin       scene frame, m
/// @param direction    unit vector, scene frame
/// @param penetration  share of a bush that the ray gets through, (0, 1)
/// @param time         of the shot, at which walking people are placed, s
/// @throws InvalidArgument for an origin or a time that is not finite, a direction that is not a
/// unit vector or a penetration that is not between 0 and 1
std::optional<Hit> nearest_hit(const Scene& scene, const Vector3<double>& origin,
                               const Vector3<double>& direction, double penetration = 0.5,
                               double time = 0.0);

/// Reads planes: [{name, distance_m, normal_azimuth_deg, normal_zenith_deg, extent_m, center_m,
/// sigma_deg, waves, bow_m, patches, reflectivity, glass}], of which only the first four are
/// needed, stations: [{name, position_m, roll_deg, pitch_deg, yaw_deg, sigma_deg}], of which only
/// the name is, boxes: [{name, center_m, size_m, yaw_deg, reflectivity}], people: [{name, from_m,
/// to_m, speed_m_per_s, size_m, reflectivity}], terrain: {origin, ground, roofs, buildings, bushes,
/// village}, footprint and limit_by_reflectivity, see docs/files.md. Each may be absent.
/// @param path  for messages only
/// @throws FileError with the line for anything else
Scene parse_scene(const std::string& text, const std::string& path);

/// parse_scene of a file. @throws FileError
Scene load_scene(const std::string& path);

}  // namespace risley::scenes
