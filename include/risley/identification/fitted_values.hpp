// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/identification/identify.hpp"

namespace risley::identification {

/// What a hypothesis says of a parameter, in the unit of files; sigmas NaN where it has none.
struct FittedValue {
  std::string name, unit;
  double value = 0, sigma = 0, sigma_given_held = 0;
};

/// All that a hypothesis says, in the order of parameter_list(): the prisms' parameters but those
/// held at zero, mean speeds, rotation angles at the first shot.
std::vector<FittedValue> fitted_values(const Hypothesis& hypothesis);

}  // namespace risley::identification
