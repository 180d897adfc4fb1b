// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/wall_matching.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

namespace risley::calibration {
namespace {

/// Planes as found are off by the calibration errors that the adjustment will find: a degree or
/// two. WallMatching.AsFarAsUncalibratedPlanesMayBeOff
constexpr double kSameDirection = radians_from_degrees(5.0);
constexpr double kSameDistance = 0.05;        // of the distance
constexpr double kSameDistanceAtLeast = 0.3;  // m

/// A found plane in the scene's frame: its normal away from the scene's origin, which is towards
/// the station if that stands behind the wall.
Plane in_scene(const Plane& plane, const scenes::Station& station) {
  const Vector3<double> normal = station.scene_from_sensor(plane.normal);
  const double distance = plane.distance + dot(normal, station.position);
  return distance < 0 ? Plane{-normal, -distance} : Plane{normal, distance};
}

double side_of(const Plane& plane, const Plane& scene, const scenes::Station& station) {
  return dot(station.scene_from_sensor(plane.normal), scene.normal) < 0 ? -1.0 : 1.0;
}

double angle_of(const Plane& a, const Plane& b) { return angle_between(a.normal, b.normal); }

bool same_wall(const Plane& a, const Plane& b) {
  return angle_of(a, b) < kSameDirection &&
         std::abs(a.distance - b.distance) <
             kSameDistanceAtLeast + kSameDistance * std::abs(a.distance);
}

std::string normal_text(const Plane& plane) {
  const auto angles = angles_from_direction(plane.normal);
  return fmt::format("azimuth {:.1f}, zenith {:.1f} degrees, distance {:.2f} m",
                     degrees_from_radians(angles.azimuth), degrees_from_radians(angles.zenith),
                     plane.distance);
}

}  // namespace

WallMatching match_walls(std::vector<FoundPlane>& found, const std::vector<std::string>& recordings,
                         const std::optional<scenes::Scene>& planes,
                         const std::vector<scenes::Station>& stations) {
  WallMatching result;
  result.stations_known = planes.has_value() || !stations.empty();
  std::vector<scenes::Station> poses = stations;
  if (poses.empty()) {
    poses.resize(recordings.size());
    for (std::size_t r = 0; r < recordings.size(); ++r) poses[r].name = recordings[r];
  }
  for (const scenes::Station& pose : poses) {
    StationPose station;
    station.name = pose.name;
    station.sigma = pose.sigma;
    station.position << pose.position.x, pose.position.y, pose.position.z;
    const Vector3<double> axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int i = 0; i < 3; ++i) {
      const Vector3<double> turned = pose.scene_from_sensor(axes[i]);
      station.stated.col(i) << turned.x, turned.y, turned.z;
    }
    station.scene_from_sensor = station.stated;
    if (!stations.empty() && pose.sigma == 0.0) {
      warn(result.warnings, kWarning.taken_as_exact,
           "station {} has no sigma_deg: its rotation is taken as exact and is not tested",
           pose.name);
    }
    result.stations.push_back(std::move(station));
  }
  if (!result.stations_known) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      found[i].wall = i;
      const Vector3<double>& normal = found[i].plane.normal;
      result.walls.push_back({fmt::format("plane {}", i + 1), normal, normal, -1});
    }
    return result;
  }

  // Known planes come first, the rest as they are found; each wall is seen from some recordings.
  std::vector<Plane> where;
  std::vector<std::vector<std::size_t>> seen_by;
  if (planes) {
    for (const scenes::ScenePlane& known : planes->planes) {
      const Vector3<double>& normal = known.plane.normal;
      result.walls.push_back({known.name, normal, normal, known.normal_sigma.value_or(-1)});
      where.push_back(known.plane);
      seen_by.emplace_back();
    }
  }
  const std::size_t listed = where.size();
  for (FoundPlane& plane : found) {
    const Plane mine = in_scene(plane.plane, poses[plane.recording]);
    std::size_t best = where.size();
    for (std::size_t w = 0; w < where.size(); ++w) {
      if (same_wall(where[w], mine) &&
          (best == where.size() || angle_of(where[w], mine) < angle_of(where[best], mine))) {
        best = w;
      }
    }
    if (best == where.size()) {
      result.walls.push_back({fmt::format("plane {}", result.walls.size() - listed + 1),
                              mine.normal, mine.normal, -1});
      where.push_back(mine);
      seen_by.emplace_back();
    } else if (result.walls[best].normal_sigma < 0 && seen_by[best].empty()) {
      result.walls[best].normal = mine.normal;  // listed by name only
    }
    plane.wall = best;
    plane.side = side_of(plane.plane, mine, poses[plane.recording]);
    seen_by[best].push_back(plane.recording);
  }
  const auto nearest = [&](const Plane& plane, std::size_t except) {
    std::size_t best = where.size();
    for (std::size_t w = 0; w < where.size(); ++w) {
      if (w == except) continue;
      if (best == where.size() || angle_of(where[w], plane) < angle_of(where[best], plane))
        best = w;
    }
    return best;
  };

  bool known_seen = false, known_given = false;
  for (std::size_t w = 0; w < listed; ++w) {
    const bool known = result.walls[w].normal_sigma >= 0;
    known_given = known_given || known;
    known_seen = known_seen || (known && !seen_by[w].empty());
    if (seen_by[w].empty()) {
      warn(result.warnings, kWarning.not_seen, "plane {} is not seen in any recording ({})",
           result.walls[w].name, normal_text(where[w]));
    }
  }
  if (known_given && !known_seen && !found.empty()) {
    const Plane first = in_scene(found.front().plane, poses[found.front().recording]);
    throw EstimationError(
        fmt::format("none of the known planes is seen: the largest plane of {} is at {}",
                    recordings[found.front().recording], normal_text(first)));
  }
  // A station that shares no wall with another one carries no information on the datum, or is not
  // at its stated place.
  if (!stations.empty() && recordings.size() > 1) {
    for (std::size_t r = 0; r < recordings.size(); ++r) {
      const FoundPlane* own = nullptr;
      bool shared = false;
      for (const FoundPlane& plane : found) {
        if (plane.recording != r) continue;
        if (own == nullptr) own = &plane;
        const auto& others = seen_by[plane.wall];
        shared = shared || result.walls[plane.wall].normal_sigma >= 0 ||
                 std::ranges::any_of(others, [r](std::size_t o) { return o != r; });
      }
      if (own == nullptr || shared) continue;
      const Plane mine = in_scene(own->plane, poses[r]);
      const std::size_t other = nearest(mine, own->wall);
      std::string message = fmt::format(
          "station {} contradicts the data: none of its walls is seen from another station; its "
          "largest one is at {} in the scene",
          poses[r].name, normal_text(mine));
      if (other < where.size()) {
        message += fmt::format(", {:.1f} degrees from the nearest one, {} at {}",
                               degrees_from_radians(angle_of(where[other], mine)),
                               result.walls[other].name, normal_text(where[other]));
      }
      throw EstimationError(message);
    }
  }
  // Walls without shots are not unknowns.
  std::vector<std::size_t> row(result.walls.size());
  std::vector<Wall> seen;
  for (std::size_t w = 0; w < result.walls.size(); ++w) {
    row[w] = seen.size();
    if (!seen_by[w].empty()) seen.push_back(result.walls[w]);
  }
  result.walls = std::move(seen);
  for (FoundPlane& plane : found) plane.wall = row[plane.wall];
  return result;
}

}  // namespace risley::calibration
