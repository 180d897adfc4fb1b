// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "parameter_choice.hpp"

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/optics/parameters.hpp"

namespace risley::app {

void add_parameter_choice(CLI::App& verb, ParameterWishes& wishes) {
  verb.add_option(
          "--fix", wishes.fixed,
          "Hold a parameter at VALUE, in the unit that its name ends with, or at the sensor's "
          "value (repeatable)")
      ->type_name("NAME[=VALUE]")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  verb.add_option("--free", wishes.freed, "Estimate this parameter as well (repeatable)")
      ->type_name("NAME")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
}

std::pair<std::string, double> assignment(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw InvalidArgument(fmt::format("'{}', expected NAME=VALUE", text));
  }
  const std::string name = text.substr(0, equals);
  double value = number_from(text.substr(equals + 1), name);
  if (const ParameterInfo* known = find_parameter_of_any_train(name)) value *= known->si_per_unit;
  return {name, value};
}

jobs::HeldParameters held_parameters(const std::vector<std::string>& fixed) {
  jobs::HeldParameters held;
  for (const std::string& text : fixed) {
    if (text.find('=') == std::string::npos) {
      held.emplace_back(text, std::nullopt);
    } else {
      held.emplace_back(assignment(text));
    }
  }
  return held;
}

jobs::ParameterValues parameter_values(const std::vector<std::string>& assignments) {
  jobs::ParameterValues values;
  values.reserve(assignments.size());
  for (const std::string& text : assignments) values.push_back(assignment(text));
  return values;
}

void add_simulated_values(CLI::App& verb, SimulatedValues& values) {
  verb.add_option(
          "--set", values.set,
          "Set a parameter of the true sensor, in the unit that its name ends with (repeatable)")
      ->type_name("NAME=VALUE")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  verb.add_option("--reported", values.reported,
                  "Set the sensor's own value of a parameter, if not the truth (repeatable); "
                  "'nominal' sets every error parameter to 0 (default: the truth)")
      ->type_name("NAME=VALUE|nominal")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
}

void take_simulated_values(const SimulatedValues& values, jobs::SimulationOptions& job) {
  job.set = parameter_values(values.set);
  std::vector<std::string> believed = values.reported;
  job.reported_nominal = std::erase(believed, "nominal") > 0;
  job.reported = parameter_values(believed);
}

}  // namespace risley::app
