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

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

#include "scenes/furniture_hit.hpp"
#include "scenes/ray.hpp"
#include "scenes/wall_hit.hpp"

namespace risley::scenes {
namespace {

/// Points where a ray passes through panes of glass, the first sixteen found.
class Panes {
 public:
  void add(double range) {
    if (count_ < ranges_.size()) ranges_[count_++] = range;
  }
  /// Share of the light that panes transmit to a target and back.
  double transmission(double range) const {
    double left = 1.0;
    for (std::size_t i = 0; i < count_; ++i) {
      if (ranges_[i] < range) left *= kGlassTransmission;
    }
    return left;
  }

 private:
  std::array<double, 16> ranges_{};
  std::size_t count_ = 0;
};

/// Replaces the previous hit if a wall with shape, patches or glass is nearer.
void take_wall(const ScenePlane& wall, std::size_t surface, const Vector3<double>& origin,
               const Vector3<double>& direction, std::optional<Hit>& nearest, Panes& panes) {
  static const double mirrors = std::cos(kGlassReturnAngle);
  const auto hit = meet_wall(wall, origin, direction, nearest ? nearest->range : kFarthestHit);
  if (!hit || (nearest && hit->range >= nearest->range)) return;
  const double cosine = std::min(1.0, std::abs(dot(hit->normal, direction)));
  if (hit->glass && cosine < mirrors) {
    panes.add(hit->range);
    return;
  }
  nearest = Hit{hit->range, cosine, surface, hit->normal, hit->reflectivity};
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

std::size_t Scene::surfaces() const {
  return planes.size() + (terrain ? terrain->surfaces() : 0) + boxes.size() + people.size();
}

std::string Scene::surface_name(std::size_t surface) const {
  require_place("surface", surface, surfaces());
  if (surface < planes.size()) return planes[surface].name;
  std::size_t rest = surface - planes.size();
  if (terrain) {
    if (rest < terrain->surfaces()) return terrain->surface_name(rest);
    rest -= terrain->surfaces();
  }
  return rest < boxes.size() ? boxes[rest].name : people[rest - boxes.size()].name;
}

std::optional<Hit> nearest_hit(const Scene& scene, const Vector3<double>& origin,
                               const Vector3<double>& direction, double penetration, double time) {
  require_finite("origin.x", origin.x, "m");
  require_finite("origin.y", origin.y, "m");
  require_finite("origin.z", origin.z, "m");
  require_unit_length("direction", norm(direction));
  if (!(penetration > 0.0 && penetration < 1.0)) {
    throw InvalidArgument(
        fmt::format("penetration = {:g}, allowed above 0 and below 1", penetration));
  }
  require_finite("time", time, "s");
  const ScenePlane* plain = nullptr;
  double nearest_range = std::nextafter(kFarthestHit, kInfinite);
  bool all_plain = true;
  for (const ScenePlane& each : scene.planes) {
    if (!is_plain(each)) {
      all_plain = false;
      continue;
    }
    const double range = hit_distance(each.plane, origin, direction);
    if (!(range > 0.0 && range < nearest_range)) continue;
    if (each.extent) {
      const Vector3<double> from_foot =
          origin + range * direction - each.plane.distance * each.plane.normal;
      const double across = dot(from_foot, each.horizontal_axis) - each.center[0];
      const double up = dot(from_foot, each.vertical_axis) - each.center[1];
      if (std::abs(across) > 0.5 * (*each.extent)[0] || std::abs(up) > 0.5 * (*each.extent)[1]) {
        continue;
      }
    }
    nearest_range = range;
    plain = &each;
  }
  const bool found = plain != nullptr;
  const auto plain_hit = [&] {
    return Hit{nearest_range, std::min(1.0, std::abs(dot(plain->plane.normal, direction))),
               static_cast<std::size_t>(plain - scene.planes.data()), plain->plane.normal,
               plain->reflectivity};
  };
  if (all_plain && !scene.terrain && scene.boxes.empty() && scene.people.empty()) {
    return found ? std::optional<Hit>(plain_hit()) : std::nullopt;  // most scenes: quick
  }
  std::optional<Hit> nearest;
  if (found) nearest = plain_hit();
  std::optional<Panes> panes;
  if (!all_plain) {
    panes.emplace();
    for (std::size_t i = 0; i < scene.planes.size(); ++i) {
      if (!is_plain(scene.planes[i])) {
        take_wall(scene.planes[i], i, origin, direction, nearest, *panes);
      }
    }
  }
  if (scene.terrain) {
    const double farthest = nearest ? nearest->range : kFarthestHit;
    if (auto hit = scene.terrain->nearest_hit(origin, direction, farthest, penetration)) {
      hit->surface += scene.planes.size();
      nearest = hit;
    }
  }
  if (!scene.boxes.empty() || !scene.people.empty()) {
    const std::size_t first = scene.surfaces() - scene.boxes.size() - scene.people.size();
    for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
      meet_box(scene.boxes[i], first + i, origin, direction, nearest);
    }
    for (std::size_t i = 0; i < scene.people.size(); ++i) {
      meet_person(scene.people[i], first + scene.boxes.size() + i, origin, direction, time,
                  nearest);
    }
  }
  if (nearest && panes) nearest->reflectivity *= panes->transmission(nearest->range);
  return nearest;
}

}  // namespace risley::scenes
