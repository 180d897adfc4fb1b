// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/sensors/sensor.hpp"

namespace risley::app {

/// A parameter as files and the command line have it.
struct NamedValue {
  std::string name;
  double value = 0;  ///< in the unit
  std::string unit;
};

/// Every parameter of a sensor; a name shared by all prisms only where the prisms agree.
std::vector<NamedValue> sensor_values(const sensors::Sensor& sensor);

}  // namespace risley::app
