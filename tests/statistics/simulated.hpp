// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/core/angle.hpp"
#include "risley/estimation/evaluation.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/scanner.hpp"

namespace risley::testing {

/// A simulated recording in memory with its truth.
struct Simulated {
  recordings::Observations observations;
  recordings::TruthColumns truth;
};

inline void append(recordings::TruthColumns& all, const recordings::TruthColumns& more) {
  const auto add = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  if (all.prisms() == 0) all.resize(more.prisms(), 0);
  add(all.time_ns, more.time_ns);
  for (std::size_t k = 0; k < all.rotation_angle.size(); ++k) {
    add(all.rotation_angle[k], more.rotation_angle[k]);
    add(all.angular_velocity[k], more.angular_velocity[k]);
  }
  add(all.azimuth, more.azimuth);
  add(all.zenith, more.zenith);
  add(all.range, more.range);
}

inline Simulated simulate(const simulation::SimulationSettings& settings) {
  simulation::Scanner scanner(settings);
  Simulated result;
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  while (scanner.read(chunk, truth)) {
    result.observations.append(chunk.observations);
    append(result.truth, truth);
  }
  return result;
}

/// Section 3.2 of the paper: 30 s at 1 kHz of Table 3's unit with 0.01 degree noise.
inline simulation::SimulationSettings table3_settings(std::uint64_t seed) {
  simulation::SimulationSettings settings;
  settings.truth = sensors::load_sensor("mid-40-table3");
  settings.duration = 30.0;
  settings.rate = 1000.0;
  settings.angle_noise = radians_from_degrees(0.01);
  settings.quantize = false;
  settings.rotor = simulation::RotorKind::sinusoidal;
  settings.seed = seed;
  return settings;
}

/// Estimates as the command does with its defaults: from the nominal Mid-40. The filter takes a
/// thousand shots a second, the batch estimator all.
inline estimation::Estimate estimate(estimation::Method method,
                                     const recordings::Observations& observations,
                                     double angle_noise_deg,
                                     std::vector<estimation::RotorProcess> process = {},
                                     const std::string& sensor = "mid-40") {
  estimation::SelectionOptions selection;
  if (method == estimation::Method::ekf) selection.rate = 1000.0;
  estimation::ShotSelector selector(selection);
  selector.add(observations);
  estimation::EstimateOptions options;
  options.sensor = sensors::load_sensor(sensor);
  options.angle_noise = radians_from_degrees(angle_noise_deg);
  options.rotor_process = std::move(process);
  return estimation::estimate(method, selector.take_series(), selector.head(), options);
}

}  // namespace risley::testing
