// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Table 3 of the paper with a noise of your own: 30 s of a Mid-40, thinned to 1000 shots a second.
// How large are the errors, are they as large as the sigmas say, and how near to the Cramer-Rao
// bound, the least average error of an unbiased estimator?
//
//   02_table_3 [NOISE_DEG] [--folder FOLDER]     0.01 degree of noise without one
#include <cmath>
#include <string>

#include <risley/core/angle.hpp>
#include <risley/jobs/estimate_recording.hpp>
#include <risley/jobs/observability.hpp>
#include <risley/jobs/simulation_settings.hpp>
#include <risley/optics/parameters.hpp>
#include <risley/simulation/truth_file.hpp>

#include "example.hpp"

using namespace risley;

/// Sigma and bound of a quantity by name, SI units.
double sigma_of(const estimation::Estimate& estimate, const std::string& name) {
  for (const auto& one : estimate.values) {
    if (one.name == name) return one.sigma_given_held;
  }
  throw InvalidArgument("the estimate has no " + name);
}
double bound_of(const estimation::Observability& observability, const std::string& name) {
  for (const auto& one : observability.quantities) {
    if (one.name == name) return one.sigma;
  }
  throw InvalidArgument("the plan has no " + name);
}

int table_3(const Arguments& arguments) {
  const double noise = arguments.value.empty() ? 0.01 : std::stod(arguments.value);  // deg
  jobs::SimulationOptions simulation;
  simulation.sensor = "mid-40-table3";
  simulation.duration = 30.0;
  simulation.rate = 1000.0;
  simulation.angle_noise = radians_from_degrees(noise);
  simulation.seed = 1;
  jobs::EstimateRecordingOptions options;
  const std::string recording = arguments.folder / "table-3.nc";
  simulation::simulate_to_file(jobs::simulation_settings(simulation), recording, {});
  options.recording = recording;
  options.truth = simulation::truth_preset_path(recording);
  const jobs::EstimatedRecording found = jobs::estimate_recording(options);
  if (!found.estimate.converged || !found.evaluation) return 1;

  jobs::ObservabilityOptions plan;  // the bound needs no data
  plan.sensor = simulation.sensor;
  plan.duration = *simulation.duration;
  plan.rate = simulation.rate;
  plan.angle_noise = simulation.angle_noise;
  const estimation::Observability bounds = jobs::judge_observability(plan).observability;

  const TrainShape shape = found.estimate.sensor.shape();
  double squares = 0;
  int parameters = 0;
  fmt::print("noise {:g} degree\n{:31}{:>9}{:>11}{:>11}{:>11}{:>13}\n", noise, "parameter", "truth",
             "error", "sigma", "bound", "error/bound");
  for (const estimation::TruthComparison& one : found.evaluation->parameters) {
    if (find_parameter(one.name, shape).kind != ParameterKind::train) continue;
    const double bound = bound_of(bounds, one.name);
    fmt::print("{:31}{:9.4f}{:11.6f}{:11.6f}{:11.6f}{:13.2f}\n", one.name,
               in_file_unit(one.name, one.truth, shape), in_file_unit(one.name, one.error, shape),
               in_file_unit(one.name, sigma_of(found.estimate, one.name), shape),
               in_file_unit(one.name, bound, shape), one.error / bound);
    squares += std::pow(one.error / bound, 2);
    ++parameters;
  }
  fmt::print("root mean square of error/bound: {:.2f} (about 1 over many seeds)\n",
             std::sqrt(squares / parameters));
  return 0;
}

int main(int argc, char** argv) { return run_example(argc, argv, table_3); }
