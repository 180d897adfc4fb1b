// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/identification/identify.hpp"

namespace risley::identification {

/// A hypothesis's value of a parameter, in the unit of files; sigmas NaN if it has none.
struct FittedValue {
  std::string name, unit;
  double value = 0, sigma = 0, sigma_given_held = 0;
};

/// All values of a hypothesis, in the order of parameter_list(): the prisms' parameters except
/// those held at zero, mean speeds, rotation angles at the first shot.
std::vector<FittedValue> fitted_values(const Hypothesis& hypothesis);

}  // namespace risley::identification
