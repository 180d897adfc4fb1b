// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/range_terms.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/calibration/rays.hpp"
#include "risley/sensors/footprint.hpp"
#include "risley/sensors/prism_sizes.hpp"
#include "risley/sensors/range_errors.hpp"
#include "risley/sensors/range_values.hpp"

#include "calibration/shot_blocks.hpp"

namespace risley::calibration {
namespace {

constexpr double kNearSigma = 0.02, kIncidenceSigma = 0.3, kDecadeSigma = 0.01,
                 kEmitterSigma = 0.01;

/// Half the depth of the footprint on a plane, m.
double depth_on(const Vector3<double>& normal, const Vector3<double>& beam, double range,
                const BeamDivergence& divergence) {
  const sensors::FootprintAxes axes = sensors::footprint_axes(beam);
  const double depth =
      sensors::footprint_depth(range, sensors::footprint_slope(normal, beam, axes.horizontal),
                               sensors::footprint_slope(normal, beam, axes.vertical),
                               divergence.horizontal, divergence.vertical);
  return std::isfinite(depth) ? depth : 0.0;
}

}  // namespace

std::vector<RangeTerm> range_terms_of(const sensors::Sensor& sensor, bool intensities) {
  std::vector<RangeTerm> terms;
  const auto add = [&](std::string name, RangeTermKind kind, double sigma, int emitter = 0) {
    const sensors::Knowledge* known = sensor.find_knowledge(name);
    const double value = known ? sensors::get_range_value(sensor, name) : 0.0;
    terms.push_back({std::move(name), value, value, known ? known->sigma : sigma, kind, emitter});
  };
  add("range_near_m", RangeTermKind::near, kNearSigma);
  if (sensor.beam_divergence_horizontal > 0 || sensor.beam_divergence_vertical > 0) {
    add("range_incidence", RangeTermKind::incidence, kIncidenceSigma);
  }
  if (intensities) add("range_per_decade_m", RangeTermKind::per_decade, kDecadeSigma);
  for (int j = 0; sensor.train.emitters() > 1 && j < sensor.train.emitters(); ++j) {
    add(fmt::format("range_emitter_{}_m", j + 1), RangeTermKind::emitter, kEmitterSigma, j);
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
  std::vector<SizePrior> priors;
  for (PrismSize& size : own_prism_sizes(sensor.prisms())) {
    const double value = sensors::prism_size(sensor, size);
    double sigma = sensors::prism_size_sigma(sensor, size);
    for (const PrismSize& shared : shared_prism_sizes()) {
      const bool same_kind = shared.rate.thickness.empty() == size.rate.thickness.empty();
      if (same_kind) sigma = std::max(sigma, sensors::prism_size_sigma(sensor, shared));
    }
    priors.push_back({std::move(size), value, sigma});
  }
  return priors;
}

PrismGeometry one_size_each(const PrismGeometry& geometry, int prisms) {
  const auto expanded = [](const std::vector<double>& values, int count) {
    if (values.size() > 1) return values;
    return std::vector<double>(count, values.empty() ? 0.0 : values.front());
  };
  return {expanded(geometry.thickness, prisms), expanded(geometry.spacing, prisms - 1)};
}

}  // namespace risley::calibration
