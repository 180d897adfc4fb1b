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

inline Simulated simulate(const simulation::SimulationSettings& settings) {
  simulation::Scanner scanner(settings);
  Simulated result;
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  while (scanner.read(chunk, truth)) {
    result.observations.append(chunk.observations);
    result.truth.append(truth);
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
