// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/range_values.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/error.hpp"
#include "risley/core/text.hpp"

namespace risley::sensors {
namespace {

constexpr std::string_view kOffset = "range_offset_m";
constexpr std::string_view kNear = "range_near_m";
constexpr std::string_view kIncidence = "range_incidence";
constexpr std::string_view kPerDecade = "range_per_decade_m";
constexpr std::string_view kEmitter = "range_emitter_";

std::string emitter_name(int emitter) { return fmt::format("{}{}_m", kEmitter, emitter + 1); }

/// The value of that name, which the sensor must have.
RangeValue find_range_value(const Sensor& sensor, std::string_view name) {
  std::vector<std::string> names;
  for (RangeValue& value : range_values(sensor.train.emitters())) {
    if (value.name == name) return value;
    names.push_back(std::move(value.name));
  }
  throw InvalidArgument(fmt::format(
      "unknown value \"{}\" of the ranges of a sensor with {} "
      "emitters{}; known: {}",
      name, sensor.train.emitters(), did_you_mean(name, names), fmt::join(names, ", ")));
}

/// Number of the emitter of such a name, or -1.
int emitter_of(const Sensor& sensor, std::string_view name) {
  for (int i = 0; i < sensor.train.emitters(); ++i) {
    if (name == emitter_name(i)) return i;
  }
  return -1;
}

}  // namespace

std::vector<RangeValue> range_values(int emitters) {
  std::vector<RangeValue> values{{std::string(kOffset), "m", -100, 100},
                                 {std::string(kNear), "m", -100, 100},
                                 {std::string(kIncidence), "1", -100, 100},
                                 {std::string(kPerDecade), "m", -100, 100}};
  for (int i = 0; i < emitters; ++i) {
    values.push_back({emitter_name(i), "m", -100, 100});
  }
  return values;
}

bool is_range_value(std::string_view name) {
  const auto values = range_values(kMaxEmitters);
  return std::any_of(values.begin(), values.end(),
                     [&](const RangeValue& value) { return value.name == name; });
}

double range_error(const Sensor& sensor, double range, double footprint_depth, double intensity,
                   std::size_t emitter) {
  const RangeErrors& errors = sensor.range_errors;
  return sensor.range_offset + errors.near * near_share(range) +
         errors.incidence * footprint_depth + errors.per_decade * intensity_decades(intensity) +
         (errors.emitter.empty() ? 0.0 : errors.emitter[emitter]);
}

double get_range_value(const Sensor& sensor, std::string_view name) {
  find_range_value(sensor, name);
  if (name == kOffset) return sensor.range_offset;
  const RangeErrors& errors = sensor.range_errors;
  if (name == kNear) return errors.near;
  if (name == kIncidence) return errors.incidence;
  if (name == kPerDecade) return errors.per_decade;
  const auto emitter = static_cast<std::size_t>(emitter_of(sensor, name));
  return emitter < errors.emitter.size() ? errors.emitter[emitter] : 0.0;
}

void set_range_value(Sensor& sensor, std::string_view name, double value) {
  const RangeValue known = find_range_value(sensor, name);
  if (!(value >= known.lower && value <= known.upper)) {
    throw InvalidArgument(fmt::format("{} = {:.10g} {}, allowed {:g} to {:g}", name, value,
                                      known.unit, known.lower, known.upper));
  }
  RangeErrors& errors = sensor.range_errors;
  if (name == kOffset) {
    sensor.range_offset = value;
  } else if (name == kNear) {
    errors.near = value;
  } else if (name == kIncidence) {
    errors.incidence = value;
  } else if (name == kPerDecade) {
    errors.per_decade = value;
  } else {
    errors.emitter.resize(static_cast<std::size_t>(sensor.train.emitters()), 0.0);
    errors.emitter[static_cast<std::size_t>(emitter_of(sensor, name))] = value;
  }
}

}  // namespace risley::sensors
