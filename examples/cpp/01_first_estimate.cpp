// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What does a sensor believe about its optics? Estimates the parameters with which it computed the
// directions that it reports, from a recording of yours or, without one, from a simulated second of
// a Mid-40 whose prisms are a little tilted.
//
//   01_first_estimate [RECORDING] [--folder FOLDER]
#include <risley/jobs/estimate_recording.hpp>
#include <risley/jobs/simulation_settings.hpp>
#include <risley/optics/parameters.hpp>
#include <risley/simulation/truth_file.hpp>

#include "example.hpp"

using namespace risley;

int first_estimate(const Arguments& arguments) {
  jobs::EstimateRecordingOptions options;
  options.recording = arguments.value;
  if (options.recording.empty()) {
    jobs::SimulationOptions simulation;
    simulation.sensor = "mid-40-table3";
    simulation.duration = 1.0;
    simulation.seed = 1;
    const std::string unit = arguments.folder / "unit.nc";
    const auto made = simulation::simulate_to_file(jobs::simulation_settings(simulation), unit, {});
    options.recording = unit;
    fmt::print("{} shots simulated\n", made.observations);
  }
  options.files.folder = arguments.folder;  // calibration.yaml and states.nc

  const estimation::Estimate found = jobs::estimate_recording(options).estimate;

  // sigma: with what held parameters, such as the wedge angles, may be off by.
  fmt::print("{:31}{:>15}{:>11}{:>12}  unit\n", "parameter", "value", "sigma", "given held");
  const TrainShape shape = found.sensor.shape();
  for (const estimation::EstimatedValue& one : found.values) {
    fmt::print("{:31}{:15.5f}{:11.5f}{:12.6f}  {}\n", one.name,
               in_file_unit(one.name, one.value, shape), in_file_unit(one.name, one.sigma, shape),
               in_file_unit(one.name, one.sigma_given_held, shape),
               find_parameter(one.name, shape).unit);
  }
  fmt::print("{}\nwhat to do: {}\n", found.verdict.words, found.verdict.to_do);
  if (!found.converged) {
    fmt::print(stderr, "the numbers cannot be used: {}\n", found.reason);
    return 1;
  }
  fmt::print("written: {}\n", (arguments.folder / "calibration.yaml").string());
  return 0;
}

int main(int argc, char** argv) { return run_example(argc, argv, first_estimate); }
