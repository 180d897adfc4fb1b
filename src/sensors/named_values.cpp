// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/named_values.hpp"

#include <algorithm>

namespace risley::sensors {

std::vector<NamedValue> named_values(const Sensor& sensor) {
  std::vector<NamedValue> values;
  for (const ParameterInfo& parameter : parameter_list(sensor.shape())) {
    if (parameter.kind == ParameterKind::rotation_angle) continue;
    if (parameter.kind == ParameterKind::train) {
      const double first = sensor.train[parameter.places.front()];
      if (std::any_of(parameter.places.begin(), parameter.places.end(),
                      [&](int place) { return sensor.train[place] != first; })) {
        continue;
      }
    }
    values.push_back(
        {parameter.name, sensor.get(parameter.name) / parameter.si_per_unit, parameter.unit});
  }
  return values;
}

}  // namespace risley::sensors
