// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "risley/sensors/sensor.hpp"

namespace risley::sensors {

/// A number in a sensor's range error model, see RangeErrors.
struct RangeValue {
  std::string name;  ///< "range_offset_m", "range_near_m", "range_incidence", "range_emitter_1_m"
  std::string unit;  ///< "m" or "1": files hold the value unchanged
  double lower = 0, upper = 0;  ///< allowed
};

/// All of them of a sensor with that many emitters: range_offset_m, range_near_m, range_incidence,
/// range_per_decade_m, range_emitter_1_m, ...
std::vector<RangeValue> range_values(int emitters);

/// Whether it is the name of a range value of some sensor.
bool is_range_value(std::string_view name);

/// Error that a sensor adds to one range, m, see RangeErrors.
/// @param range            true, m
/// @param footprint_depth  see footprint_depth(), m
/// @param intensity        as reported
/// @param emitter          that fired, from 0
double range_error(const Sensor& sensor, double range, double footprint_depth, double intensity,
                   std::size_t emitter);

/// @throws InvalidArgument for a name that the sensor does not have
double get_range_value(const Sensor& sensor, std::string_view name);
/// @throws InvalidArgument for an unknown name and for a value out of bounds
void set_range_value(Sensor& sensor, std::string_view name, double value);

}  // namespace risley::sensors
