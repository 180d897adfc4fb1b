// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "risley/estimation/estimate.hpp"
#include "risley/estimation/evaluation.hpp"
#include "risley/recordings/truth.hpp"
#include "risley/simulation/scanner.hpp"

#include "reproduction/reproduce.hpp"

namespace risley::reproduction {

/// A simulated recording as an estimation takes it, with what truly happened.
struct SimulatedRun {
  simulation::SimulationSettings settings;
  estimation::AngleSeries series, head;
  recordings::TruthColumns truth;
  std::string serial;
};

/// @param ranges  whether the series keeps them
SimulatedRun simulate(const simulation::SimulationSettings& settings, bool ranges = false);

/// The unit of Table 3 with rotors that swing as in Fig. 9. Directions are not rounded.
simulation::SimulationSettings unit_settings(const ReproduceOptions& options, std::uint64_t run);

/// As the command estimates with its defaults, from the nominal type.
/// @param angle_noise  given to the estimator, rad
estimation::Estimate estimate_run(estimation::Method method, const SimulatedRun& run,
                                  const sensors::Sensor& type, double angle_noise,
                                  std::vector<estimation::RotorProcess> process = {});

/// Shots thinned to a rate, as the filter takes them.
estimation::AngleSeries thinned_to(const estimation::AngleSeries& series, double rate);

/// The seed of the i-th random draw: draws of different user seeds do not overlap.
std::uint64_t run_seed(const ReproduceOptions& options, std::size_t i);

/// The value of an estimate under a name, in the unit of files. @throws InvalidArgument
const estimation::EstimatedValue& value_of(const estimation::Estimate& estimate,
                                           const std::string& name);
double si_per_unit(const std::string& name);

double mean_of(const std::vector<double>& values);
double root_mean_square(const std::vector<double>& values);
double standard_deviation(const std::vector<double>& values);

}  // namespace risley::reproduction
