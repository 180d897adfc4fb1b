// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/labelled_shots.hpp"

#include <algorithm>
#include <cmath>

#include "risley/calibration/rays.hpp"
#include "risley/core/direction.hpp"

namespace risley::calibration {

ViewDistances view_distances(const PlanarProblem& problem, std::size_t view,
                             const LabelledShots& recording, const std::vector<int>& labels) {
  ViewDistances d;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == static_cast<int>(view)) d.rows.push_back(i);
  }
  const RangedShots shots = rows_of(recording.shots, d.rows);
  const PlaneView plane = plane_view(problem, view);
  const Rays rays(problem.train, problem.geometry, shots);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const Vector3<double> direction = rays.direction(i);
    const auto angles = angles_from_direction(direction);
    const double cosine = dot(plane.plane.normal, direction);
    const double range = shots.range[i] - plane.range_offset;
    const double across =
        recording.pointing * range * std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
    d.azimuth.push_back(angles.azimuth);
    d.zenith.push_back(angles.zenith);
    d.distance.push_back(signed_distance(plane.plane, rays.point(i, range)));
    d.sigma.push_back(std::sqrt(plane.range_variance * cosine * cosine + across * across));
    d.incidence.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)));
  }
  return d;
}

}  // namespace risley::calibration
