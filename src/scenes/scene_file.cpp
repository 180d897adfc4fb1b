// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"
#include "risley/io/yaml_map.hpp"
#include "risley/scenes/scene.hpp"

#include "scenes/scene_fields.hpp"
#include "scenes/terrain_file.hpp"

namespace risley::scenes {
namespace {

using io::fail_at;
using io::YamlMap;

double reflectivity(const YamlMap& map) {
  return map.real("reflectivity", 1e-3L, 1, "", kMattReflectivity);
}

Vector3<double> place(const YamlMap& map, std::string_view key) {
  const auto [x, y, z] = numbers<3>(map, key, -kFarthestHit, kFarthestHit);
  return {x, y, z};
}

/// @param own_seed  for waves that state none
WallWaves read_waves(const YamlMap& map, std::uint64_t own_seed) {
  map.allow_only({"peak_to_valley_m", "half_wave_m", "seed"});
  return {map.real("peak_to_valley_m", 0, 1, "m"),
          map.real("half_wave_m", 0.05L, kFarthestHit, "m"),
          map.find("seed") == nullptr
              ? own_seed
              : static_cast<std::uint64_t>(map.integer("seed", 0, 2'147'483'647))};
}

Patch read_patch(const YamlMap& map, const ScenePlane& plane) {
  map.allow_only({"name", "center_m", "size_m", "depth_m", "reflectivity", "glass"});
  Patch patch;
  if (map.find("name") != nullptr) patch.name = map.text("name");
  patch.center = numbers<2>(map, "center_m", -kFarthestHit, kFarthestHit);
  patch.size = numbers<2>(map, "size_m", 1e-3L, kFarthestHit);
  patch.depth = map.real("depth_m", -100, 100, "m", patch.depth);
  if (map.find("reflectivity") != nullptr) patch.reflectivity = reflectivity(map);
  patch.glass = map.yes("glass");
  for (std::size_t i = 0; plane.extent && i < 2; ++i) {
    constexpr double kRounding = 1e-9;
    if (std::abs(patch.center[i] - plane.center[i]) + 0.5 * patch.size[i] >
        0.5 * (*plane.extent)[i] + kRounding) {
      fail_at(
          map.path(), map.line(),
          fmt::format("{} reaches beyond the extent of \"{}\"", map.field("size_m"), plane.name));
    }
  }
  return patch;
}

/// Properties of a plane other than a flat surface of one kind.
/// @param number_of_plane  in the file, counted from 0: the seed of waves that state none
void read_surface(const YamlMap& map, std::size_t number_of_plane, ScenePlane& plane) {
  plane.reflectivity = reflectivity(map);
  plane.glass = map.yes("glass");
  std::vector<WallWaves> waves;
  if (const auto* entry = map.find("waves")) {
    if (entry->value.is_list()) {
      for (const YamlMap& each : map.maps("waves"))
        waves.push_back(read_waves(each, number_of_plane + 1000 * waves.size()));
    } else {
      waves.push_back(read_waves(map.section("waves"), number_of_plane));
    }
  }
  double bow = 0.0;
  if (const auto* entry = map.find("bow_m")) {
    if (!plane.extent) {
      fail_at(map.path(), entry->line,
              fmt::format("{} needs {}", map.field("bow_m"), map.field("extent_m")));
    }
    bow = map.real("bow_m", -10, 10, "m");
  }
  plane.shape = WallShape(waves, bow, plane.extent, plane.center);
  for (const YamlMap& each : map.maps("patches")) plane.patches.push_back(read_patch(each, plane));
  if (plane.patches.size() > kMostPatches) {
    fail_at(map.path(), map.at("patches").line,
            fmt::format("{} has {} entries, allowed {}", map.field("patches"), plane.patches.size(),
                        kMostPatches));
  }
}

SceneBox read_box(const YamlMap& map, Names& earlier) {
  map.allow_only({"name", "center_m", "size_m", "yaw_deg", "reflectivity"});
  SceneBox box;
  box.name = new_name(map, earlier);
  box.center = place(map, "center_m");
  box.size = numbers<3>(map, "size_m", 1e-3L, kFarthestHit);
  const double yaw = map.find("yaw_deg") == nullptr ? 0.0 : angle(map, "yaw_deg", -360, 360);
  box.forward = {std::cos(yaw), std::sin(yaw), 0.0};
  box.reflectivity = reflectivity(map);
  return box;
}

Person read_person(const YamlMap& map, Names& earlier) {
  map.allow_only({"name", "from_m", "to_m", "speed_m_per_s", "size_m", "reflectivity"});
  Person person;
  person.name = new_name(map, earlier);
  person.from = place(map, "from_m");
  person.to = place(map, "to_m");
  person.speed = map.real("speed_m_per_s", 0, 100, "m/s");
  if (map.find("size_m") != nullptr) person.size = numbers<2>(map, "size_m", 0.01L, 100);
  person.reflectivity = reflectivity(map);
  return person;
}

/// @param number_of_plane  in the file, counted from 0
ScenePlane read_plane(const YamlMap& map, std::size_t number_of_plane, Names& earlier) {
  map.allow_only({"name", "distance_m", "normal_azimuth_deg", "normal_zenith_deg", "extent_m",
                  "center_m", "sigma_deg", "waves", "bow_m", "patches", "reflectivity", "glass"});
  ScenePlane plane;
  plane.name = new_name(map, earlier);
  const double azimuth = angle(map, "normal_azimuth_deg", -360, 360);
  const double zenith = angle(map, "normal_zenith_deg", 0, 180);
  plane.plane =
      plane_from_angles({azimuth, zenith}, map.real("distance_m", 1e-3L, kFarthestHit, "m"));
  plane.horizontal_axis = {-std::sin(azimuth), std::cos(azimuth), 0.0};
  plane.vertical_axis = cross(plane.plane.normal, plane.horizontal_axis);
  if (map.find("extent_m") != nullptr)
    plane.extent = numbers<2>(map, "extent_m", 1e-3L, kFarthestHit);
  if (const auto* center = map.find("center_m")) {
    if (!plane.extent) {
      fail_at(map.path(), center->line,
              fmt::format("{} needs {}", map.field("center_m"), map.field("extent_m")));
    }
    plane.center = numbers<2>(map, "center_m", -kFarthestHit, kFarthestHit);
  }
  if (map.find("sigma_deg") != nullptr) plane.normal_sigma = angle(map, "sigma_deg", 0, 180);
  read_surface(map, number_of_plane, plane);
  return plane;
}

Station read_station(const YamlMap& map, Names& earlier) {
  map.allow_only({"name", "position_m", "roll_deg", "pitch_deg", "yaw_deg", "sigma_deg"});
  Station station;
  station.name = new_name(map, earlier);
  if (map.find("position_m") != nullptr) station.position = place(map, "position_m");
  const auto optional_angle = [&](std::string_view key, double lower_deg) {
    return map.find(key) == nullptr ? 0.0 : angle(map, key, lower_deg, 360);
  };
  station.roll = optional_angle("roll_deg", -360);
  station.pitch = optional_angle("pitch_deg", -360);
  station.yaw = optional_angle("yaw_deg", -360);
  station.sigma = optional_angle("sigma_deg", 0);
  return station;
}

}  // namespace

Scene parse_scene(const std::string& text, const std::string& path) {
  const YamlMap root(io::parse_yaml(text, path), path, "");
  root.allow_only(
      {"planes", "stations", "terrain", "boxes", "people", "footprint", "limit_by_reflectivity"});
  Scene scene;
  Names planes, stations;
  for (const YamlMap& map : root.maps("planes"))
    scene.planes.push_back(read_plane(map, scene.planes.size(), planes));
  for (const YamlMap& map : root.maps("stations"))
    scene.stations.push_back(read_station(map, stations));
  if (root.find("terrain") != nullptr) {
    scene.terrain = read_terrain(root.section("terrain"), planes);
  }
  for (const YamlMap& map : root.maps("boxes")) scene.boxes.push_back(read_box(map, planes));
  for (const YamlMap& map : root.maps("people")) scene.people.push_back(read_person(map, planes));
  scene.footprint = root.yes("footprint");
  scene.limit_by_reflectivity = root.yes("limit_by_reflectivity");
  return scene;
}

Scene load_scene(const std::string& path) { return parse_scene(io::read_text_file(path), path); }

}  // namespace risley::scenes
