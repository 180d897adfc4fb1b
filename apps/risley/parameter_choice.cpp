// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "parameter_choice.hpp"

#include <algorithm>

#include "risley/optics/prism.hpp"

namespace risley::app {

void add_parameter_choice(CLI::App& verb, ParameterWishes& wishes) {
  verb.add_option("--fix", wishes.fixed,
                  "Hold a parameter, at a value if one is given (repeatable)")
      ->type_name("NAME[=VALUE]")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  verb.add_option("--free", wishes.freed, "Estimate one more parameter (repeatable)")
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
    // The train is not known yet; a name means the same in any, and only emitters' names differ.
    for (const TrainShape& shape : {TrainShape{kMaxPrisms, 1}, {kMaxPrisms, kMaxEmitters}}) {
      const auto& known = parameter_list(shape);
      const auto found = std::find_if(known.begin(), known.end(),
                                      [&](const ParameterInfo& one) { return one.name == name; });
      if (found == known.end()) continue;
      value *= found->si_per_unit;
      break;
    }
    held.emplace_back(name, value);
  }
  return held;
}

}  // namespace risley::app
