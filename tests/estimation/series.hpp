// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <random>

#include "risley/core/angle.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::testing {

/// Shots of a sensor at constant speed, straight from the optics.
inline estimation::AngleSeries constant_speed_series(const sensors::Sensor& sensor, double start_a,
                                                     double start_b, double duration, double rate,
                                                     double noise_deg = 0.0, unsigned seed = 0) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  estimation::AngleSeries series;
  const auto shots = static_cast<std::size_t>(std::llround(duration * rate)) + 1;
  const auto train =
      prepare<double, 2>(parameter_array<2>(sensor.train), face_order_array<2>(sensor.train));
  for (std::size_t i = 0; i < shots; ++i) {
    const auto ns = std::llround(1e9 * static_cast<double>(i) / rate);
    const double t = 1e-9 * static_cast<double>(ns);
    const auto beam = trace(train, {start_a + t * sensor.angular_velocity[0],
                                    start_b + t * sensor.angular_velocity[1]});
    const auto angles = angles_from_direction(beam.direction);
    const double noise = radians_from_degrees(noise_deg);
    const double azimuth = angles.azimuth + noise * normal(generator);
    series.append(ns, azimuth, angles.zenith + noise * normal(generator));
  }
  return series;
}

}  // namespace risley::testing
