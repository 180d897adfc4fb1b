// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/scenes/scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/io/text_file.hpp"
#include "risley/io/yaml_map.hpp"

#include "scenes/scene_fields.hpp"
#include "scenes/terrain_file.hpp"

namespace risley::scenes {
namespace {

using io::fail_at;
using io::YamlMap;

ScenePlane read_plane(const YamlMap& map, Names& earlier) {
  map.allow_only({"name", "distance_m", "normal_azimuth_deg", "normal_zenith_deg", "extent_m",
                  "center_m", "sigma_deg"});
  ScenePlane plane;
  plane.name = new_name(map, earlier);
  const double azimuth = angle(map, "normal_azimuth_deg", -360, 360);
  const double zenith = angle(map, "normal_zenith_deg", 0, 180);
  plane.plane =
      plane_from_angles({azimuth, zenith}, number(map, "distance_m", 1e-3L, kFarthestHit, "m"));
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
  return plane;
}

Station read_station(const YamlMap& map, Names& earlier) {
  map.allow_only({"name", "position_m", "roll_deg", "pitch_deg", "yaw_deg", "sigma_deg"});
  Station station;
  station.name = new_name(map, earlier);
  if (map.find("position_m") != nullptr) {
    const auto [x, y, z] = numbers<3>(map, "position_m", -kFarthestHit, kFarthestHit);
    station.position = {x, y, z};
  }
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

Vector3<double> Station::scene_from_sensor(const Vector3<double>& direction) const {
  const auto turned = [](double a, double b, double by) {
    return std::pair{std::cos(by) * a - std::sin(by) * b, std::sin(by) * a + std::cos(by) * b};
  };
  Vector3<double> v = direction;
  if (roll != 0.0) std::tie(v.y, v.z) = turned(v.y, v.z, roll);
  if (pitch != 0.0) std::tie(v.z, v.x) = turned(v.z, v.x, pitch);
  if (yaw != 0.0) std::tie(v.x, v.y) = turned(v.x, v.y, yaw);
  return v;
}

Station Scene::station(std::string_view name) const {
  if (name.empty()) return {};
  std::vector<std::string> known;
  for (const Station& station : stations) {
    if (station.name == name) return station;
    known.push_back(station.name);
  }
  throw InvalidArgument(
      fmt::format("unknown station \"{}\", the scene has: {}", name,
                  known.empty() ? "none" : fmt::format("{}", fmt::join(known, ", "))));
}

std::size_t Scene::surfaces() const { return planes.size() + (terrain ? terrain->surfaces() : 0); }

std::string Scene::surface_name(std::size_t surface) const {
  require_place("surface", surface, surfaces());
  return surface < planes.size() ? planes[surface].name
                                 : terrain->surface_name(surface - planes.size());
}

std::optional<Hit> nearest_hit(const Scene& scene, const Vector3<double>& origin,
                               const Vector3<double>& direction, double penetration) {
  require_finite("origin.x", origin.x, "m");
  require_finite("origin.y", origin.y, "m");
  require_finite("origin.z", origin.z, "m");
  require_unit_length("direction", norm(direction));
  if (!(penetration > 0.0 && penetration < 1.0)) {
    throw InvalidArgument(
        fmt::format("penetration = {:g}, allowed above 0 and below 1", penetration));
  }
  std::optional<Hit> nearest;
  for (std::size_t i = 0; i < scene.planes.size(); ++i) {
    const ScenePlane& each = scene.planes[i];
    const double range = hit_distance(each.plane, origin, direction);
    if (!(range > 0.0 && range <= kFarthestHit) || (nearest && range >= nearest->range)) continue;
    if (each.extent) {
      const Vector3<double> from_foot =
          origin + range * direction - each.plane.distance * each.plane.normal;
      const double across = dot(from_foot, each.horizontal_axis) - each.center[0];
      const double up = dot(from_foot, each.vertical_axis) - each.center[1];
      if (std::abs(across) > 0.5 * (*each.extent)[0] || std::abs(up) > 0.5 * (*each.extent)[1]) {
        continue;
      }
    }
    nearest = Hit{range, std::min(1.0, std::abs(dot(each.plane.normal, direction))), i};
  }
  if (scene.terrain) {
    const double farthest = nearest ? nearest->range : kFarthestHit;
    if (auto hit = scene.terrain->nearest_hit(origin, direction, farthest, penetration)) {
      hit->surface += scene.planes.size();
      nearest = hit;
    }
  }
  return nearest;
}

Scene parse_scene(const std::string& text, const std::string& path) {
  const YamlMap root(io::parse_yaml(text, path), path, "");
  root.allow_only({"planes", "stations", "terrain"});
  Scene scene;
  Names planes, stations;
  for_each_map(root, "planes",
               [&](const YamlMap& map) { scene.planes.push_back(read_plane(map, planes)); });
  for_each_map(root, "stations",
               [&](const YamlMap& map) { scene.stations.push_back(read_station(map, stations)); });
  if (const auto* entry = root.find("terrain")) {
    scene.terrain = read_terrain(YamlMap(entry->value, path, "terrain"), planes);
  }
  return scene;
}

Scene load_scene(const std::string& path) { return parse_scene(io::read_text_file(path), path); }

}  // namespace risley::scenes
