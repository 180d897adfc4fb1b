// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "risley/jobs/sensor_choice.hpp"
#include "risley/jobs/simulation_settings.hpp"

#include "command.hpp"

namespace risley::app {

/// Options on parameters, as typed.
struct ParameterWishes {
  std::vector<std::string> fixed, freed;
};

/// Declares --fix and --free.
void add_parameter_choice(CLI::App& verb, ParameterWishes& wishes);

/// Values of a simulated sensor, as typed.
struct SimulatedValues {
  std::vector<std::string> set, reported;
};

/// Declares --set and --reported.
void add_simulated_values(CLI::App& verb, SimulatedValues& values);
/// What was typed, for a simulation. @throws InvalidArgument
void take_simulated_values(const SimulatedValues& values, jobs::SimulationOptions& job);

/// NAME=VALUE, the value in SI units where the name is known. @throws InvalidArgument
std::pair<std::string, double> assignment(const std::string& text);

/// NAME and NAME=VALUE as jobs accept them; jobs refuse unknown names. @throws InvalidArgument
jobs::HeldParameters held_parameters(const std::vector<std::string>& fixed);
/// The same for NAME=VALUE alone.
jobs::ParameterValues parameter_values(const std::vector<std::string>& assignments);

}  // namespace risley::app
