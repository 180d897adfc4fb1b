// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "scenes/terrain_file.hpp"

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

#include "scenes/terrain_limits.hpp"

namespace risley::scenes {
namespace {

using io::fail_at;
using io::YamlMap;

double within(const YamlMap& map, std::string_view key, const Limits& limits) {
  return map.real(key, limits.lowest, limits.highest, "m");
}

double heading(const YamlMap& map) {
  return map.find("heading_deg") == nullptr ? 0.0 : angle(map, "heading_deg", -360, 360);
}

std::array<double, 2> center(const YamlMap& map) {
  return numbers<2>(map, "center_m", kPlaceLimits.lowest, kPlaceLimits.highest);
}

/// [low, high]
std::array<double, 2> range(const YamlMap& map, std::string_view key, const Limits& limits,
                            std::string_view unit) {
  const auto values = numbers<2>(map, key, limits.lowest, limits.highest, unit);
  if (values[0] > values[1]) {
    fail_at(
        map.path(), map.at(key).line,
        fmt::format("{} = [{:g}, {:g}] {}, expected the least value first and the greatest second",
                    map.field(key), values[0], values[1], unit));
  }
  return values;
}

/// Its own name, or one made of its kind and its number.
std::string name_of(const YamlMap& map, std::string_view kind, std::size_t number, Names& names) {
  if (map.find("name") != nullptr) return new_name(map, names);
  std::string name = fmt::format("{} {}", kind, number);
  if (!names.insert(name).second) {
    fail_at(map.path(), map.line(),
            fmt::format("{} has no name, and \"{}\" is already used; give it a name",
                        map.field("name"), name));
  }
  return name;
}

Ground read_ground(const YamlMap& map) {
  map.allow_only({"height_m", "relief", "waves"});
  Ground ground;
  if (map.find("height_m") != nullptr) ground.height = within(map, "height_m", kHeightLimits);
  for (const YamlMap& each : map.maps("relief")) {
    each.allow_only({"amplitude_m", "wavelength_x_m", "wavelength_y_m"});
    ground.relief.push_back({within(each, "amplitude_m", kAmplitudeLimits),
                             within(each, "wavelength_x_m", kWavelengthLimits),
                             within(each, "wavelength_y_m", kWavelengthLimits)});
  }
  for (const YamlMap& each : map.maps("waves")) {
    each.allow_only({"amplitude_m", "wavelength_m", "heading_deg"});
    ground.waves.push_back({within(each, "amplitude_m", kAmplitudeLimits),
                            within(each, "wavelength_m", kWavelengthLimits), heading(each)});
  }
  if (ground.relief.size() + ground.waves.size() > kMostSines) {
    fail_at(
        map.path(), map.line(),
        fmt::format("{} and {} have {} entries, allowed {} together", map.field("relief"),
                    map.field("waves"), ground.relief.size() + ground.waves.size(), kMostSines));
  }
  return ground;
}

MapOrigin read_origin(const YamlMap& map) {
  map.allow_only({"latitude_deg", "longitude_deg", "ellipsoidal_height_m"});
  return {angle(map, "latitude_deg", -90, 90), angle(map, "longitude_deg", -360, 360),
          within(map, "ellipsoidal_height_m", kHeightLimits)};
}

GableRoof read_roof(const YamlMap& map, std::string name) {
  map.allow_only({"name", "center_m", "length_m", "face_width_m", "pitch_deg", "ridge_height_m",
                  "heading_deg", "walls"});
  GableRoof roof;
  roof.name = std::move(name);
  roof.center = center(map);
  roof.length = within(map, "length_m", kSizeLimits);
  roof.face_width = within(map, "face_width_m", kSizeLimits);
  roof.pitch = angle(map, "pitch_deg", kPitchLimits_deg.lowest, kPitchLimits_deg.highest);
  roof.ridge_height = within(map, "ridge_height_m", kSizeLimits);
  roof.heading = heading(map);
  roof.walls = map.yes("walls");
  return roof;
}

VillageSettings read_village(const YamlMap& map) {
  map.allow_only({"seed", "center_m", "half_extent_m", "roofs", "minimum_distance_m", "length_m",
                  "face_width_m", "pitch_deg", "ridge_height_m", "walls", "bushes", "bush_radius_m",
                  "bush_height_m"});
  VillageSettings village;
  village.seed = static_cast<std::uint64_t>(map.integer("seed", 0, 2'147'483'647));
  if (map.find("center_m") != nullptr) village.center = center(map);
  village.half_extent = within(map, "half_extent_m", kSizeLimits);
  const auto count = [&](std::string_view key) {
    return map.find(key) == nullptr ? 0 : map.integer(key, 0, kMostVillageRoofs);
  };
  village.roofs = count("roofs");
  village.bushes = count("bushes");
  if (village.roofs + village.bushes == 0) {
    fail_at(map.path(), map.line(),
            fmt::format("{} has neither {} nor {}", map.field("village"), map.field("roofs"),
                        map.field("bushes")));
  }
  if (village.roofs > 0) {
    village.minimum_distance = map.real("minimum_distance_m", 0, kSizeLimits.highest, "m");
    village.length = within(map, "length_m", kSizeLimits);
    village.face_width = within(map, "face_width_m", kSizeLimits);
    const auto pitch_deg = range(map, "pitch_deg", kPitchLimits_deg, "deg");
    village.pitch = {radians_from_degrees(pitch_deg[0]), radians_from_degrees(pitch_deg[1])};
    village.ridge_height = range(map, "ridge_height_m", kSizeLimits, "m");
    village.walls = map.yes("walls");
  }
  if (village.bushes > 0) {
    village.bush_radius = range(map, "bush_radius_m", kSizeLimits, "m");
    village.bush_height = range(map, "bush_height_m", kSizeLimits, "m");
  }
  return village;
}

}  // namespace

Terrain read_terrain(const YamlMap& map, Names& names) {
  map.allow_only({"origin", "ground", "roofs", "buildings", "bushes", "village"});
  TerrainParts parts;
  const auto has = [&](std::string_view key) { return map.find(key) != nullptr; };
  if (has("origin")) parts.origin = read_origin(map.section("origin"));
  if (has("ground")) parts.ground = read_ground(map.section("ground"));
  names.insert("ground");
  for (const YamlMap& each : map.maps("roofs"))
    parts.roofs.push_back(read_roof(each, name_of(each, "roof", parts.roofs.size() + 1, names)));
  for (const YamlMap& each : map.maps("buildings")) {
    each.allow_only({"name", "center_m", "size_m", "height_m", "heading_deg"});
    parts.buildings.push_back({name_of(each, "building", parts.buildings.size() + 1, names),
                               center(each),
                               numbers<2>(each, "size_m", kSizeLimits.lowest, kSizeLimits.highest),
                               within(each, "height_m", kSizeLimits), heading(each)});
  }
  for (const YamlMap& each : map.maps("bushes")) {
    each.allow_only({"name", "center_m", "radius_m", "height_m"});
    parts.bushes.push_back({name_of(each, "bush", parts.bushes.size() + 1, names), center(each),
                            within(each, "radius_m", kSizeLimits),
                            within(each, "height_m", kSizeLimits)});
  }
  try {
    if (has("village")) add_village(read_village(map.section("village")), parts);
    return Terrain(std::move(parts));
  } catch (const InvalidArgument& error) {  // what no single field shows
    fail_at(map.path(), map.line(), fmt::format("terrain: {}", error.what()));
  }
}

}  // namespace risley::scenes
