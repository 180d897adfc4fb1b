// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/labelled_shots.hpp"

#include <algorithm>
#include <cmath>

#include "risley/calibration/rays.hpp"
#include "risley/core/direction.hpp"

#include "calibration/range_terms.hpp"
#include "calibration/shot_blocks.hpp"

namespace risley::calibration {

ViewDistances view_distances(const PlanarProblem& problem, std::size_t view,
                             const LabelledShots& recording, const std::vector<int>& labels) {
  ViewDistances d;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == static_cast<int>(view)) d.rows.push_back(i);
  }
  const RangedShots shots = rows_of(recording.shots, d.rows);
  const PlaneView plane = plane_view(problem, view);
  for (auto* column : {&d.azimuth, &d.zenith, &d.distance, &d.sigma, &d.incidence}) {
    column->resize(shots.size());
  }
  for_each_block(shots.size(), [&](std::size_t begin, std::size_t end) {
    const Rays rays(problem.train, problem.geometry, shots, {begin, end});
    for (std::size_t i = begin; i < end; ++i) {
      const Vector3<double> direction = rays.direction(i - begin);
      const auto angles = angles_from_direction(direction);
      const double cosine = dot(plane.plane.normal, direction);
      const double range =
          shots.range[i] -
          range_error(problem, term_shot(shots, i, rays.origin(i - begin), direction, plane.plane));
      const double across =
          recording.pointing * range * std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
      d.azimuth[i] = angles.azimuth;
      d.zenith[i] = angles.zenith;
      d.distance[i] = signed_distance(plane.plane, rays.point(i - begin, range));
      d.sigma[i] = std::sqrt(plane.range_variance * cosine * cosine + across * across);
      d.incidence[i] = std::acos(std::clamp(cosine, -1.0, 1.0));
    }
  });
  return d;
}

}  // namespace risley::calibration
