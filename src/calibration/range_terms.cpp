// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/range_terms.hpp"

#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "risley/calibration/rays.hpp"
#include "risley/sensors/range_errors.hpp"

#include "calibration/shot_blocks.hpp"

namespace risley::calibration {
namespace {

constexpr double kNearSigma = 0.02, kIncidenceSigma = 0.3, kDecadeSigma = 0.01,
                 kEmitterSigma = 0.01;
constexpr std::string_view kNear = "range_near_m", kIncidence = "range_incidence",
                           kPerDecade = "range_per_decade_m", kEmitter = "range_emitter_";

/// Half the depth of the footprint on a plane, m.
double depth_on(const Vector3<double>& normal, const Vector3<double>& beam, double range,
                const BeamDivergence& divergence) {
  // A direction turned across the beam changes the range by -r (n.e) / (n.L).
  const Vector3<double> horizontal = normalized(cross({0, 0, 1}, beam));
  const Vector3<double> vertical = cross(beam, horizontal);
  const double approach = dot(normal, beam);
  const double depth = sensors::footprint_depth(range, dot(normal, horizontal) / approach,
                                                dot(normal, vertical) / approach,
                                                divergence.horizontal, divergence.vertical);
  return std::isfinite(depth) ? depth : 0.0;
}

}  // namespace

std::vector<RangeTerm> range_terms_of(const sensors::Sensor& sensor, bool intensities) {
  std::vector<RangeTerm> terms;
  const auto add = [&](std::string name, RangeTermKind kind, int emitter, double value,
                       double sigma) {
    const sensors::Knowledge* known = sensor.find_knowledge(name);
    if (known == nullptr) value = 0;
    terms.push_back({std::move(name), value, value, known ? known->sigma : sigma, kind, emitter});
  };
  const sensors::RangeErrors& errors = sensor.range_errors;
  add(std::string(kNear), RangeTermKind::near, 0, errors.near, kNearSigma);
  if (sensor.beam_divergence_horizontal > 0 || sensor.beam_divergence_vertical > 0) {
    add(std::string(kIncidence), RangeTermKind::incidence, 0, errors.incidence, kIncidenceSigma);
  }
  if (intensities) {
    add(std::string(kPerDecade), RangeTermKind::per_decade, 0, errors.per_decade, kDecadeSigma);
  }
  for (int j = 0; sensor.train.emitters() > 1 && j < sensor.train.emitters(); ++j) {
    const auto at = static_cast<std::size_t>(j);
    add(fmt::format("{}{}_m", kEmitter, j + 1), RangeTermKind::emitter, j,
        at < errors.emitter.size() ? errors.emitter[at] : 0.0, kEmitterSigma);
  }
  return terms;
}

double range_share(const PlanarProblem& problem, const RangeTerm& term, const TermShot& shot) {
  switch (term.kind) {
    case RangeTermKind::near:
      return sensors::near_share(shot.range);
    case RangeTermKind::incidence:
      return depth_on(shot.normal, shot.direction, shot.range, problem.divergence);
    case RangeTermKind::per_decade:
      return shot.intensity < 0 ? 0.0 : sensors::intensity_decades(shot.intensity);
    case RangeTermKind::emitter:
      break;
  }
  return shot.beam == term.emitter ? 1.0 : 0.0;
}

double range_error(const PlanarProblem& problem, const TermShot& shot) {
  double error = problem.range_offset;
  for (const RangeTerm& term : problem.range_terms) {
    if (term.value != 0) error += term.value * range_share(problem, term, shot);
  }
  return error;
}

TermShot term_shot(const RangedShots& shots, std::size_t shot, const Vector3<double>& origin,
                   const Vector3<double>& direction, const Plane& plane) {
  return {direction, plane.normal, hit_distance(plane, origin, direction),
          shots.intensity.empty() ? -1.0 : static_cast<double>(shots.intensity[shot]),
          shots.beam.empty() ? 0 : shots.beam[shot]};
}

void fill_range_terms(const PlanarProblem& problem, std::size_t view, RangedShots& shots) {
  const Plane plane = plane_view(problem, view).plane;
  shots.range_terms.assign(problem.range_terms.size(), std::vector<float>(shots.size()));
  if (problem.range_terms.empty()) return;
  for_each_block(shots.size(), [&](std::size_t begin, std::size_t end) {
    const Rays rays(problem.train, problem.geometry, shots, {begin, end});
    for (std::size_t i = begin; i < end; ++i) {
      const TermShot shot =
          term_shot(shots, i, rays.origin(i - begin), rays.direction(i - begin), plane);
      for (std::size_t t = 0; t < problem.range_terms.size(); ++t) {
        shots.range_terms[t][i] =
            static_cast<float>(range_share(problem, problem.range_terms[t], shot));
      }
    }
  });
}

std::vector<SizePrior> size_priors(const sensors::Sensor& sensor) {
  const PrismGeometry geometry = one_size_each(sensor.geometry, sensor.prisms());
  std::vector<SizePrior> priors;
  for (PrismSize& size : own_prism_sizes(sensor.prisms())) {
    const bool thickness = !size.rate.thickness.empty();
    const sensors::Knowledge* known = sensor.find_knowledge(size.name);
    if (known == nullptr) {
      known = sensor.find_knowledge(thickness ? "prism_thickness_m" : "prism_spacing_m");
    }
    const double value = size_value(geometry, size);
    priors.push_back({std::move(size), value, known ? known->sigma : 0.0});
  }
  return priors;
}

PrismGeometry one_size_each(const PrismGeometry& geometry, int prisms) {
  const auto expanded = [](const std::vector<double>& values, int count) {
    if (values.size() > 1) return values;
    return std::vector<double>(static_cast<std::size_t>(count),
                               values.empty() ? 0.0 : values.front());
  };
  return {expanded(geometry.thickness, prisms), expanded(geometry.spacing, prisms - 1)};
}

}  // namespace risley::calibration
