// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "simulation/beam_returns.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include "risley/core/square.hpp"
#include "risley/sensors/range_errors.hpp"

namespace risley::simulation {
namespace {

/// Rays of equal energy that represent a footprint: each ninth of both divergences has one, the
/// first is the middle of the beam.
constexpr int kRays = 9;
/// Position of ray i along the horizontal and the vertical axis, in ninths of the divergences.
constexpr std::array<std::array<int, 2>, kRays> kPlaces{
    {{0, 0}, {1, 4}, {-1, -4}, {2, -1}, {-2, 1}, {3, 3}, {-3, -3}, {4, -2}, {-4, 2}}};
/// Surfaces with a smaller range difference give one pulse, at their mean range, m. Assumed: pulses
/// of 4 ns.
constexpr double kPulseLength = 0.6;
/// Data sheets state the maximum range for this reflectivity.
constexpr double kReflectivityOfLimits = 0.8;

}  // namespace

BeamReturns::BeamReturns(const scenes::Scene& scene, const sensors::Sensor& sensor)
    : scene_(&scene),
      sensor_(&sensor),
      footprint_(scene.footprint && (sensor.beam_divergence_horizontal > 0.0 ||
                                     sensor.beam_divergence_vertical > 0.0)),
      slopes_(sensor.range_errors.incidence != 0.0) {}

BeamReturn BeamReturns::of(const SceneBeam& beam) const {
  return footprint_ ? of_footprint(beam) : of_line(beam);
}

bool BeamReturns::detects(double range, double part) const {
  if (!(range >= sensor_->range_minimum && range <= sensor_->range_maximum)) return false;
  return !scene_->limit_by_reflectivity ||
         part * square(sensor_->range_maximum) >= kReflectivityOfLimits * square(range);
}

double BeamReturns::depth(const SceneBeam& beam, double range,
                          const Vector3<double>& normal) const {
  if (!slopes_) return 0.0;
  return sensors::footprint_depth(
      range, sensors::footprint_slope(normal, beam.direction, beam.axes.horizontal),
      sensors::footprint_slope(normal, beam.direction, beam.axes.vertical),
      sensor_->beam_divergence_horizontal, sensor_->beam_divergence_vertical);
}

BeamReturn BeamReturns::of_line(const SceneBeam& beam) const {
  BeamReturn found;
  const auto hit =
      scenes::nearest_hit(*scene_, beam.origin, beam.direction, beam.penetration, beam.time);
  if (!hit) return found;
  found.true_range = hit->range;
  found.reflectance = hit->reflectivity * hit->cosine;
  if (!detects(hit->range, found.reflectance)) return found;
  found.range = hit->range;
  found.footprint_depth = depth(beam, hit->range, hit->normal);
  return found;
}

BeamReturn BeamReturns::of_footprint(const SceneBeam& beam) const {
  BeamReturn found;
  std::array<scenes::Hit, kRays> hits;
  std::size_t count = 0;
  for (std::size_t i = 0; i < kRays; ++i) {
    const double across = sensor_->beam_divergence_horizontal * kPlaces[i][0] / kRays;
    const double up = sensor_->beam_divergence_vertical * kPlaces[i][1] / kRays;
    const Vector3<double> direction =
        i == 0
            ? beam.direction
            : normalized(beam.direction + across * beam.axes.horizontal + up * beam.axes.vertical);
    const auto hit =
        scenes::nearest_hit(*scene_, beam.origin, direction, beam.penetration, beam.time);
    if (!hit) continue;
    if (i == 0) found.true_range = hit->range;
    hits[count++] = *hit;
  }
  const auto end = hits.begin() + count;
  std::stable_sort(hits.begin(), end,
                   [](const scenes::Hit& a, const scenes::Hit& b) { return a.range < b.range; });
  // The first pulse that the sensor detects. The received energy of a ray falls with the range
  // squared.
  for (std::size_t first = 0; first < count;) {
    std::size_t last = first + 1;
    while (last < count && hits[last].range - hits[last - 1].range <= kPulseLength) ++last;
    double received = 0.0, ranges = 0.0;
    std::size_t strongest = first;
    double most = 0.0;
    for (std::size_t i = first; i < last; ++i) {
      const double part = hits[i].reflectivity * hits[i].cosine / square(hits[i].range);
      received += part;
      // Differences, so that equal ranges have exactly this mean.
      ranges += part * (hits[i].range - hits[first].range);
      if (part > most) {
        most = part;
        strongest = i;
      }
    }
    if (received > 0.0) {
      const double range = hits[first].range + ranges / received;
      const double reflectance = received / kRays * square(range);
      if (detects(range, reflectance)) {
        found.range = range;
        found.reflectance = reflectance;
        found.footprint_depth = depth(beam, range, hits[strongest].normal);
        break;
      }
    }
    first = last;
  }
  return found;
}

}  // namespace risley::simulation
