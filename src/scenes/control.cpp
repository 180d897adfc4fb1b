// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/scenes/control.hpp"

#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/io/text_file.hpp"
#include "risley/io/yaml_map.hpp"

#include "scenes/scene_fields.hpp"

namespace risley::scenes {
namespace {

using io::YamlMap;

constexpr int kControlVersion = 1;
constexpr double kFarthestPlace = 1e8;  // m
constexpr double kSmallestSigma = 1e-4, kLargestSigma = 10;
constexpr double kSmallestRadius = 0.1, kLargestRadius = 100;  // m
constexpr double kSteepest_deg = 60;

KnownGround read_known_ground(const YamlMap& map, Names& earlier) {
  map.allow_only({"name", "place_m", "sigma_m", "radius_m", "normal_azimuth_deg",
                  "normal_zenith_deg", "normal_sigma_deg"});
  KnownGround ground;
  ground.name = new_name(map, earlier);
  const auto [x, y, z] = numbers<3>(map, "place_m", -kFarthestPlace, kFarthestPlace);
  ground.place = {x, y, z};
  ground.sigma = map.real("sigma_m", kSmallestSigma, kLargestSigma, "m");
  if (map.find("radius_m") != nullptr) {
    ground.radius = map.real("radius_m", kSmallestRadius, kLargestRadius, "m");
  }
  bool leans = false;
  for (const char* key : {"normal_azimuth_deg", "normal_zenith_deg", "normal_sigma_deg"}) {
    leans = leans || map.find(key) != nullptr;
  }
  if (!leans) return ground;
  ground.normal = direction_from_angles(
      SphericalAngles<double>{angle(map, "normal_azimuth_deg", -360, 360),
                              angle(map, "normal_zenith_deg", 0, kSteepest_deg)});
  ground.normal_sigma = angle(map, "normal_sigma_deg", kSmallestSigma, kLargestSigma);
  return ground;
}

}  // namespace

void require_known_ground(const KnownGround& ground) {
  const std::string of = fmt::format("known ground \"{}\": ", ground.name);
  require_finite(of + "place.x", ground.place.x, "m");
  require_finite(of + "place.y", ground.place.y, "m");
  require_finite(of + "place.z", ground.place.z, "m");
  require_above(of + "sigma", ground.sigma, 0, "m");
  require_above(of + "radius", ground.radius, 0, "m");
  if (!ground.normal) return;
  require_unit_length(of + "normal", norm(*ground.normal));
  require_above(of + "sigma of the normal", ground.normal_sigma, 0, "rad");
}

Control parse_control(const std::string& text, const std::string& path) {
  const YamlMap root(io::parse_yaml(text, path), path, "");
  if (root.find("risley_control") == nullptr) {
    io::fail_at(path, root.line(), "is not a list of known ground: risley_control is missing");
  }
  root.integer("risley_control", kControlVersion, kControlVersion);
  root.allow_only({"risley_control", "crs", "datum", "ground"});
  Control control;
  if (root.find("crs") != nullptr) control.crs = root.text("crs");
  if (root.find("datum") != nullptr) {
    control.datum = root.text("datum");
    if (control.crs.empty()) {
      io::fail_at(path, root.at("datum").line,
                  "datum needs crs, the map projection of the coordinates");
    }
  }
  root.at("ground");
  Names names;
  for (const YamlMap& map : root.maps("ground"))
    control.ground.push_back(read_known_ground(map, names));
  if (control.ground.empty()) {
    io::fail_at(path, root.at("ground").line, "ground: the list is empty");
  }
  return control;
}

Control load_control(const std::string& path) {
  return parse_control(io::read_text_file(path), path);
}

}  // namespace risley::scenes
