// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/beam_origin_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <span>
#include <utility>

#include "risley/core/angle.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/batch.hpp"

namespace risley {
namespace {

/// Steps of an additive sequence: powers of the root of x^(n+1) = x + 1, the generalised golden
/// ratio, whose multiples fill n dimensions evenly.
std::vector<double> sequence_steps(std::size_t dimensions) {
  double root = 2.0;
  for (int i = 0; i < 60; ++i) {
    root = std::pow(1.0 + root, 1.0 / (static_cast<double>(dimensions) + 1.0));
  }
  std::vector<double> steps;
  double step = 1.0;
  for (std::size_t k = 0; k < dimensions; ++k) steps.push_back(step /= root);
  return steps;
}

}  // namespace

BeamOriginMap beam_origin_map(const PrismTrain& train, const PrismGeometry& geometry,
                              std::size_t steps, double cell) {
  check_shape(train.shape());
  require_at_least("steps", static_cast<long long>(steps), 2);
  require_above("cell", degrees_from_radians(cell), 0, "deg");
  const auto prisms = static_cast<std::size_t>(train.prisms());
  struct Extremes {
    double least_y = HUGE_VAL, greatest_y = -HUGE_VAL, least_z = HUGE_VAL, greatest_z = -HUGE_VAL;
  };
  std::map<std::pair<long, long>, Extremes> cells;
  BeamOriginMap map;
  map.cell = cell;
  std::vector<std::vector<double>> angles(prisms, std::vector<double>(steps));
  std::vector<double> azimuth(steps), zenith(steps), x(steps), y(steps), z(steps);
  DirectionColumns out;
  out.azimuth = azimuth;
  out.zenith = zenith;
  out.origin_x = x;
  out.origin_y = y;
  out.origin_z = z;
  out.geometry = geometry;
  const auto add_beams = [&] {
    for (std::size_t i = 0; i < steps; ++i) {
      if (std::isnan(azimuth[i])) continue;
      ++map.beams;
      Extremes& e = cells[{std::lround(std::floor(azimuth[i] / cell)),
                           std::lround(std::floor(zenith[i] / cell))}];
      e.least_y = std::min(e.least_y, y[i]);
      e.greatest_y = std::max(e.greatest_y, y[i]);
      e.least_z = std::min(e.least_z, z[i]);
      e.greatest_z = std::max(e.greatest_z, z[i]);
    }
  };
  const std::vector<double> sequence = sequence_steps(prisms);
  const std::size_t rows = prisms == 1 ? 1 : steps;
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t i = 0; i < steps; ++i) {
      const auto turn = [steps](std::size_t n) {
        return kTwoPi * static_cast<double>(n) / static_cast<double>(steps - 1);
      };
      if (prisms <= 2) {
        angles[0][i] = turn(i);
        if (prisms == 2) angles[1][i] = turn(row);
        continue;
      }
      const auto n = static_cast<double>(row * steps + i);
      for (std::size_t k = 0; k < prisms; ++k) {
        angles[k][i] = kTwoPi * (n * sequence[k] - std::floor(n * sequence[k]));
      }
    }
    const std::vector<std::span<const double>> columns(angles.begin(), angles.end());
    for (int emitter = 0; emitter < train.emitters(); ++emitter) {
      const std::vector<std::uint8_t> beam(steps, static_cast<std::uint8_t>(emitter));
      observe_batch(train, columns, out, beam);
      add_beams();
    }
  }
  for (const auto& [place, e] : cells) {
    map.azimuth.push_back(cell * (static_cast<double>(place.first) + 0.5));
    map.zenith.push_back(cell * (static_cast<double>(place.second) + 0.5));
    map.least_y.push_back(e.least_y);
    map.greatest_y.push_back(e.greatest_y);
    map.least_z.push_back(e.least_z);
    map.greatest_z.push_back(e.greatest_z);
  }
  return map;
}

}  // namespace risley
