// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "reproduction/runs.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley::reproduction {

SimulatedRun simulate(const simulation::SimulationSettings& settings, bool ranges) {
  simulation::Scanner scanner(settings);
  estimation::ShotSelector selector({{}, ranges});
  SimulatedRun run;
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  while (scanner.read(chunk, truth)) {
    selector.add(chunk.observations);
    run.truth.append(truth);
  }
  run.settings = settings;
  run.serial = scanner.header().devices.front().serial;
  run.head = selector.head();
  run.series = selector.take_series();
  return run;
}

simulation::SimulationSettings unit_settings(const ReproduceOptions& options, std::uint64_t run) {
  simulation::SimulationSettings settings;
  settings.truth = options.unit;
  settings.duration = 30.0;
  settings.rate = 1000.0;
  settings.angle_noise = options.angle_noise;
  settings.range_noise = options.range_noise;
  settings.quantize = false;
  settings.rotor = simulation::RotorKind::sinusoidal;
  settings.seed = run_seed(options, run);
  return settings;
}

estimation::Estimate estimate_run(estimation::Method method, const SimulatedRun& run,
                                  const sensors::Sensor& type, double angle_noise,
                                  std::vector<estimation::RotorProcess> process) {
  estimation::EstimateOptions options;
  options.sensor = type;
  options.angle_noise = angle_noise;
  options.rotor_process = std::move(process);
  return estimation::estimate(method, run.series, run.head, options);
}

estimation::AngleSeries thinned_to(const estimation::AngleSeries& series, double rate) {
  std::vector<estimation::ShotRange> ranges = estimation::stretches(series);
  return estimation::thinned(series, rate, ranges).rows();
}

std::uint64_t run_seed(const ReproduceOptions& options, std::size_t i) {
  constexpr std::uint64_t kDrawsPerSeed = 1000000;
  return options.seed * kDrawsPerSeed + i;
}

const estimation::EstimatedValue& value_of(const estimation::Estimate& estimate,
                                           const std::string& name) {
  const auto found = std::find_if(estimate.values.begin(), estimate.values.end(),
                                  [&](const auto& value) { return value.name == name; });
  if (found == estimate.values.end()) {
    throw InvalidArgument(fmt::format("{} was not estimated", name));
  }
  return *found;
}

double si_per_unit(const std::string& name) { return find_parameter(name, {2}).si_per_unit; }

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double standard_deviation(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

}  // namespace risley::reproduction
