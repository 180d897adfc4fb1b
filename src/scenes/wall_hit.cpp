// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "scenes/wall_hit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "scenes/ray.hpp"

namespace risley::scenes {
namespace {

/// Tolerance of an intersection along the ray, m.
constexpr double kTolerance = 1e-13;
constexpr int kMostIterations = 60;
constexpr int kMostSteps = 10'000;

/// A place or a way along the wall's horizontal axis, its vertical axis and its normal, m.
struct OnWall {
  double horizontal = 0, vertical = 0, height = 0;
};

bool contains(const Patch& patch, double horizontal, double vertical) {
  return std::abs(horizontal - patch.center[0]) <= 0.5 * patch.size[0] &&
         std::abs(vertical - patch.center[1]) <= 0.5 * patch.size[1];
}

/// A ray in the axes of one wall: f(t) = its height above the surface of a given depth.
class WallRay {
 public:
  WallRay(const ScenePlane& wall, const Vector3<double>& origin, const Vector3<double>& direction)
      : wall_(wall) {
    const Vector3<double> from = origin - wall.plane.distance * wall.plane.normal;
    from_ = {dot(from, wall.horizontal_axis), dot(from, wall.vertical_axis),
             signed_distance(wall.plane, origin)};
    along_ = {dot(direction, wall.horizontal_axis), dot(direction, wall.vertical_axis),
              dot(direction, wall.plane.normal)};
    tangent_ = std::sqrt(along_.horizontal * along_.horizontal + along_.vertical * along_.vertical);
    // Then the slope of f stays within a quarter of its mean, and Newton's steps converge.
    steep_ = std::abs(along_.height) > 4.0 * wall.shape.steepest() * tangent_;
  }

  /// Whether the ray meets the surface of one depth once, whatever the waves.
  bool steep() const { return steep_; }
  const OnWall& from() const { return from_; }
  const OnWall& along() const { return along_; }
  OnWall at(double t) const {
    return {from_.horizontal + t * along_.horizontal, from_.vertical + t * along_.vertical,
            from_.height + t * along_.height};
  }

  /// The patch that the ray is before at t, the last one where several overlap, or nullptr.
  const Patch* patch_at(double t) const {
    if (wall_.patches.empty()) return nullptr;
    const OnWall place = at(t);
    for (std::size_t i = wall_.patches.size(); i-- > 0;) {
      if (contains(wall_.patches[i], place.horizontal, place.vertical)) return &wall_.patches[i];
    }
    return nullptr;
  }

  struct Gap {
    double value = 0, rate = 0;  ///< f and df/dt
    Deviation deviation;
  };
  Gap gap(double t, double depth) const {
    const OnWall place = at(t);
    if (wall_.shape.flat()) return {place.height - depth, along_.height, {}};
    const Deviation d = wall_.shape.at(place.horizontal, place.vertical);
    return {
        place.height - depth - d.height,
        along_.height - d.horizontal_slope * along_.horizontal - d.vertical_slope * along_.vertical,
        d};
  }

  /// Intersection of the ray with the surface: t, NaN if there is none, and the deviation there,
  /// whose slopes are those of a place less than a micrometre away.
  struct Root {
    double t = std::nan("");
    Deviation deviation;
  };

  /// Where f is 0 within [begin, end].
  /// @param side  sign of f at begin; unused for a steep ray
  /// @param crosses  whether f is known to have the other sign at end
  Root root(double begin, double end, double depth, double side, bool crosses) const {
    if (!steep_) return first_root(begin, end, depth, side, crosses);
    Root found{(depth - from_.height) / along_.height, {}};
    if (!wall_.shape.flat()) {
      found.t = std::clamp(found.t, begin, end);
      for (int i = 0; i < kMostIterations; ++i) {
        const Gap f = gap(found.t, depth);
        const double step = -f.value / f.rate;
        found.t += step;
        found.deviation = f.deviation;
        if (step * step * wall_.shape.strongest_bend() <= kTolerance * std::abs(f.rate)) break;
      }
    }
    if (crosses) {
      found.t = std::clamp(found.t, begin, end);
    } else if (!(found.t >= begin - kSeam && found.t <= end + kSeam)) {
      return {};
    }
    return found;
  }

 private:
  /// The first root of a ray that may meet the surface several times. As long as
  /// f + f' s - bend s^2 / 2 > 0 or f - slope s > 0 the wall has not been met.
  Root first_root(double begin, double end, double depth, double side, bool crosses) const {
    const double bend = wall_.shape.strongest_bend() * tangent_ * tangent_;
    const double slope = std::abs(along_.height) + wall_.shape.steepest() * tangent_;
    double t = begin;
    Gap f;
    for (int i = 0; i < kMostSteps && t <= end; ++i) {
      f = gap(t, depth);
      const double left = side * f.value, away = side * f.rate;
      if (!(left > kTolerance)) return {t, f.deviation};
      const double bent_root = std::sqrt(away * away + 2.0 * bend * left);
      const double bent = away < 0.0   ? 2.0 * left / (bent_root - away)
                          : bend > 0.0 ? (away + bent_root) / bend
                                       : kInfinite;
      const double step = std::max(bent, left / slope);
      if (step <= 4e-16 * t) return {t, f.deviation};
      t += step;
    }
    return crosses ? Root{end, f.deviation} : Root{};
  }

  const ScenePlane& wall_;
  OnWall from_, along_;
  double tangent_ = 0;
  bool steep_ = false;
};

double depth_of(const Patch* patch) { return patch == nullptr ? 0.0 : patch->depth; }
double sign_of(double value) { return value < 0.0 ? -1.0 : 1.0; }

/// Intersection of the ray with the face of a patch or with the wall itself.
WallHit face_hit(const ScenePlane& wall, const WallRay::Root& root, const Patch* patch) {
  const Deviation& slope = root.deviation;
  WallHit hit;
  hit.range = root.t;
  hit.normal = normalized(wall.plane.normal - slope.horizontal_slope * wall.horizontal_axis -
                          slope.vertical_slope * wall.vertical_axis);
  hit.reflectivity =
      patch == nullptr ? wall.reflectivity : patch->reflectivity.value_or(wall.reflectivity);
  hit.glass = patch == nullptr ? wall.glass : patch->glass;
  return hit;
}

/// The side of a step: of the part that the ray would enter.
WallHit step_hit(const ScenePlane& wall, double t, const Patch* into, bool horizontal) {
  WallHit hit;
  hit.range = t;
  hit.normal = horizontal ? wall.horizontal_axis : wall.vertical_axis;
  hit.reflectivity =
      into == nullptr ? wall.reflectivity : into->reflectivity.value_or(wall.reflectivity);
  return hit;
}

/// Points where a ray crosses an edge of a patch. Without default values, because room for many of
/// them is made for every ray.
struct Crossing {
  double t;
  bool horizontal;  ///< whether the edge limits the patch along the horizontal axis
};

}  // namespace

std::optional<WallHit> meet_wall(const ScenePlane& wall, const Vector3<double>& origin,
                                 const Vector3<double>& direction, double farthest) {
  const WallRay ray(wall, origin, direction);
  const OnWall& from = ray.from();
  const OnWall& along = ray.along();
  double nearest_depth = 0.0, farthest_depth = 0.0;
  for (const Patch& patch : wall.patches) {
    nearest_depth = std::min(nearest_depth, patch.depth);
    farthest_depth = std::max(farthest_depth, patch.depth);
  }
  const double margin = wall.shape.highest() + kSeam;
  double enter = 0.0, leave = farthest;
  clip(from.height, along.height, nearest_depth - margin, farthest_depth + margin, enter, leave);
  if (enter > leave) return std::nullopt;
  if (wall.extent) {
    const std::array<double, 2>& center = wall.center;
    const double half_width = 0.5 * (*wall.extent)[0], half_height = 0.5 * (*wall.extent)[1];
    clip(from.horizontal, along.horizontal, center[0] - half_width, center[0] + half_width, enter,
         leave);
    clip(from.vertical, along.vertical, center[1] - half_height, center[1] + half_height, enter,
         leave);
    if (enter > leave) return std::nullopt;
  }

  // The ray crosses edges of patches at these places; between them the depth is constant.
  std::array<Crossing, 4 * kMostPatches> crossings;
  std::size_t count = 0;
  if (nearest_depth != farthest_depth) {
    const auto add = [&](double edge, double start, double rate, bool horizontal) {
      const double t = (edge - start) / rate;
      if (t > enter && t < leave && count < crossings.size()) crossings[count++] = {t, horizontal};
    };
    for (const Patch& patch : wall.patches) {
      for (const double half : {-0.5, 0.5}) {
        add(patch.center[0] + half * patch.size[0], from.horizontal, along.horizontal, true);
        add(patch.center[1] + half * patch.size[1], from.vertical, along.vertical, false);
      }
    }
    std::sort(crossings.begin(), crossings.begin() + count,
              [](const Crossing& a, const Crossing& b) { return a.t < b.t; });
  }

  double begin = enter, side = 0.0;
  const Patch* patch = ray.patch_at(0.5 * (begin + (count > 0 ? crossings[0].t : leave)));
  for (std::size_t i = 0; i < count; ++i) {
    const double end = crossings[i].t;
    if (side == 0.0) side = sign_of(ray.gap(begin, depth_of(patch)).value);
    const double next_end = i + 1 < count ? crossings[i + 1].t : leave;
    const Patch* next = ray.patch_at(0.5 * (end + next_end));
    const double before = ray.gap(end, depth_of(patch)).value;
    const bool crosses = side * before <= 0.0;
    const WallRay::Root root = crosses || !ray.steep()
                                   ? ray.root(begin, end, depth_of(patch), side, crosses)
                                   : WallRay::Root{};
    if (root.t > 0.0) return face_hit(wall, root, patch);
    // The sides of a step join both of its faces.
    if (side * (before + depth_of(patch) - depth_of(next)) <= 0.0 && end > 0.0) {
      return step_hit(wall, end, next, crossings[i].horizontal);
    }
    begin = end;
    patch = next;
  }
  if (side == 0.0 && !ray.steep()) side = sign_of(ray.gap(begin, depth_of(patch)).value);
  const WallRay::Root root = ray.root(begin, leave, depth_of(patch), side, false);
  if (!(root.t > 0.0 && root.t <= farthest)) return std::nullopt;
  // Without steps the patch is only known at the end of the ray.
  return face_hit(wall, root, count == 0 ? ray.patch_at(root.t) : patch);
}

}  // namespace risley::scenes
