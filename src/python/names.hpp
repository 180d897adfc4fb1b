// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "risley/optics/parameters.hpp"

namespace risley::python {

/// The name of a parameter with values in SI units: the name in files without the unit,
/// "wedge_angle_a" for "wedge_angle_a_deg".
std::string si_name(const std::string& file_name);

/// A parameter by either name, and the factor for a value under that name.
struct NamedParameter {
  const ParameterInfo* info = nullptr;
  double si_per_unit = 1;
};
/// @throws InvalidArgument that lists the known names
NamedParameter named_parameter(const std::string& name, TrainShape shape);
/// The same if the train is not known yet; without info for a name that no train has.
NamedParameter parameter_of_any_train(const std::string& name);

/// The unit that a name in files ends with: deg, deg/s, m, s or 1.
std::string unit_of(const std::string& file_name);

/// The SI unit for a unit in files: "rad" for "deg", "rad/s" for "deg/s", others unchanged.
std::string si_unit(const std::string& file_unit);
/// The unit in files for an SI unit, the inverse of si_unit().
struct FileUnit {
  std::string name;
  double si_per_unit = 1;
};
FileUnit file_unit(const std::string& si_unit);

}  // namespace risley::python
