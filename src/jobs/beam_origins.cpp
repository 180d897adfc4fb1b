// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/beam_origins.hpp"

#include <algorithm>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

namespace risley::jobs {

BeamOrigins beam_origins(const sensors::Sensor& sensor) {
  constexpr std::size_t kSteps = 1081;  // every third of a degree, as in the paper's Fig. A1
  constexpr double kCell = radians_from_degrees(0.5);
  BeamOrigins result{beam_origin_map(sensor.train, sensor.geometry, kSteps, kCell)};
  const BeamOriginMap& map = result.map;
  if (map.size() == 0) throw EstimationError("no beam passes through the prisms");
  result.least_y = *std::min_element(map.least_y.begin(), map.least_y.end());
  result.greatest_y = *std::max_element(map.greatest_y.begin(), map.greatest_y.end());
  result.least_z = *std::min_element(map.least_z.begin(), map.least_z.end());
  result.greatest_z = *std::max_element(map.greatest_z.begin(), map.greatest_z.end());
  return result;
}

}  // namespace risley::jobs
