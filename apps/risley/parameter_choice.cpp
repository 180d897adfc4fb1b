// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "parameter_choice.hpp"

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

jobs::HeldParameters held_parameters(const std::vector<std::string>& fixed) {
  jobs::HeldParameters held;
  for (const std::string& text : fixed) {
    if (text.find('=') == std::string::npos) {
      held.emplace_back(text, std::nullopt);
      continue;
    }
    const auto assignment = split_assignment(text);
    const std::string& name = assignment.first;
    double value = assignment.second;
    if (const ParameterInfo* known = find_parameter_of_any_train(name)) value *= known->si_per_unit;
    held.emplace_back(name, value);
  }
  return held;
}

}  // namespace risley::app
