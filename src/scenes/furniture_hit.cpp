// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "scenes/furniture_hit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "scenes/ray.hpp"

namespace risley::scenes {
namespace {

/// Replaces the previous hit if this is nearer.
void take_nearer(double range, const Vector3<double>& normal, const Vector3<double>& direction,
                 double reflectivity, std::size_t surface, std::optional<Hit>& nearest) {
  if (!(range > 0.0 && range <= kFarthestHit) || (nearest && range >= nearest->range)) return;
  nearest =
      Hit{range, std::min(1.0, std::abs(dot(normal, direction))), surface, normal, reflectivity};
}

}  // namespace

Vector3<double> Person::feet_at(double time) const {
  const Vector3<double> way = to - from;
  const double length = norm(way);
  if (length == 0.0) return from;
  const double walked = std::fmod(std::abs(speed * time), 2.0 * length);
  return from + (std::min(walked, 2.0 * length - walked) / length) * way;
}

void meet_box(const SceneBox& box, std::size_t surface, const Vector3<double>& origin,
              const Vector3<double>& direction, std::optional<Hit>& nearest) {
  const Vector3<double> left{-box.forward.y, box.forward.x, 0.0};
  const Vector3<double> from = origin - box.center;
  const std::array<double, 3> start{dot(from, box.forward), dot(from, left), from.z};
  const std::array<double, 3> along{dot(direction, box.forward), dot(direction, left), direction.z};
  double enter = -kInfinite, leave = kInfinite;
  std::size_t enter_axis = 0, leave_axis = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    double first = -kInfinite, last = kInfinite;
    clip(start[i], along[i], -0.5 * box.size[i], 0.5 * box.size[i], first, last);
    if (first > enter) {
      enter = first;
      enter_axis = i;
    }
    if (last < leave) {
      leave = last;
      leave_axis = i;
    }
  }
  if (enter > leave) return;
  const std::size_t axis = enter > 0.0 ? enter_axis : leave_axis;
  const Vector3<double> up{0.0, 0.0, 1.0};
  take_nearer(enter > 0.0 ? enter : leave,
              axis == 0   ? box.forward
              : axis == 1 ? left
                          : up,
              direction, box.reflectivity, surface, nearest);
}

void meet_person(const Person& person, std::size_t surface, const Vector3<double>& origin,
                 const Vector3<double>& direction, double time, std::optional<Hit>& nearest) {
  const double across = 2.0 / person.size[0], up = 2.0 / person.size[1];
  const Vector3<double> feet = person.feet_at(time);
  const Vector3<double> from{(origin.x - feet.x) * across, (origin.y - feet.y) * across,
                             (origin.z - feet.z) * up - 1.0};
  const Vector3<double> along{direction.x * across, direction.y * across, direction.z * up};
  // |from + t along| = 1, from the point of the ray that is nearest to the centre.
  const double square = dot(along, along);
  const double middle = -dot(from, along) / square;
  const Vector3<double> at = from + middle * along;
  const double rest = 1.0 - dot(at, at);
  if (!(rest > 0.0)) return;
  const double half = std::sqrt(rest / square);
  const double range = middle > half ? middle - half : middle + half;
  const Vector3<double> place = from + range * along;
  take_nearer(range, normalized(Vector3<double>{place.x * across, place.y * across, place.z * up}),
              direction, person.reflectivity, surface, nearest);
}

}  // namespace risley::scenes
