// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/noise_model.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "risley/core/number_text.hpp"

namespace risley::estimation {
namespace {

/// A preset's entry on one of its numbers; nullptr if there is none.
const sensors::Knowledge* stated(const sensors::Sensor& sensor, const char* name) {
  const sensors::Knowledge* known = sensor.find_knowledge(name);
  return known != nullptr && !known->source.empty() ? known : nullptr;
}

std::string source_of(const sensors::Sensor& sensor, const char* name) {
  const sensors::Knowledge* known = stated(sensor, name);
  return known != nullptr ? known->source : std::string();
}

}  // namespace

double NoiseModel::point_variance() const {
  return range * range + direction * direction * range_distance * range_distance;
}

NoiseModel noise_model(const Estimate& estimate, const sensors::Sensor& nominal) {
  constexpr std::size_t kShots = std::size_t{1} << 18;  // enough for precise means
  constexpr double kUsualIntensity = 100;               // of 255
  const AngleSeries shots = estimate.series.rows({0, std::min(estimate.series.size(), kShots)});
  double azimuth = 0, zenith = 0, across = 0;
  const double azimuth_noise = estimate.noise.value.azimuth,
               zenith_noise = estimate.noise.value.zenith;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const double a = azimuth_noise * azimuth_noise + shots.azimuth_rounding_variance[i];
    const double z = zenith_noise * zenith_noise + shots.zenith_rounding_variance[i];
    const double sine = std::sin(shots.zenith[i]);
    azimuth += a;
    zenith += z;
    across += (a * sine * sine + z) / 2;
  }
  const auto count = static_cast<double>(shots.size());
  NoiseModel model;
  model.azimuth = std::sqrt(azimuth / count);
  model.zenith = std::sqrt(zenith / count);
  model.direction = std::sqrt(across / count);
  model.range_distance = kStatedDistance;
  const double step = nominal.range_resolution;
  model.range =
      std::sqrt(nominal.range_variance(kStatedDistance, 0, kUsualIntensity) + step * step / 12.0);
  model.range_source = source_of(nominal, "range_noise_m");
  if (nominal.pointing_tolerance > 0) {
    model.shared_direction = nominal.pointing_tolerance;
    model.shared_direction_source = source_of(nominal, "pointing_tolerance_deg");
  }
  if (const sensors::Knowledge* offset = stated(nominal, "range_offset_m")) {
    if (const double sigma = std::max(offset->sigma, offset->total_sigma); sigma > 0) {
      model.shared_range = sigma;
      model.shared_range_source = offset->source;
    }
  }
  return model;
}

}  // namespace risley::estimation
