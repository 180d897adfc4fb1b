// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/sensors/sensor.hpp"

namespace risley::sensors {

/// A parameter as files have it.
struct NamedValue {
  std::string name;
  double value = 0;  ///< in the unit
  std::string unit;
};

/// Every parameter of a sensor; a name shared by all prisms only if the prisms agree.
std::vector<NamedValue> named_values(const Sensor& sensor);

}  // namespace risley::sensors
