// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/sensor_choice.hpp"

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::jobs {
namespace {

/// Type of the sensor that is assumed where a file does not name its own.
constexpr std::uint8_t kAssumedType = 1;  // Mid-40

/// The built-in preset of the instrument that made a recording.
sensors::Sensor sensor_of_recording(const recordings::RecordingHeader& header) {
  const std::uint8_t type = names_its_sensor(header) ? header.devices.front().type : kAssumedType;
  std::optional<sensors::Sensor> found;
  for (const std::string& name : sensors::builtin_preset_names()) {
    sensors::Sensor sensor = sensors::load_sensor(name);
    // Presets of single units and of reversed rotors have longer names than that of the type.
    if (sensor.device_type == type && (!found || name.size() < found->name.size())) {
      found = std::move(sensor);
    }
  }
  if (!found) {
    throw InvalidArgument(fmt::format(
        "no built-in preset for the recording's sensor ({}): say which with option sensor",
        recordings::device_type_name(type)));
  }
  return *found;
}

}  // namespace

bool names_its_sensor(const recordings::RecordingHeader& header) {
  return header.devices.front().type != recordings::kUnknownDeviceType;
}

sensors::Sensor chosen_sensor(const std::string& name_or_path,
                              const recordings::RecordingHeader& header) {
  return name_or_path.empty() ? sensor_of_recording(header) : sensors::load_sensor(name_or_path);
}

std::vector<std::string> hold(const HeldParameters& held, sensors::Sensor& sensor) {
  std::vector<std::string> names;
  for (const auto& [name, value] : held) {
    const ParameterInfo& parameter = find_parameter(name, sensor.shape());
    if (value) {
      if (parameter.kind != ParameterKind::train) {
        throw InvalidArgument(
            fmt::format("option fixed {}: only parameters of the prisms can be held", name));
      }
      sensor.set(name, *value);
    }
    names.push_back(name);
  }
  return names;
}

}  // namespace risley::jobs
