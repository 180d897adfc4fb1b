// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "risley/recordings/observations.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

// Messages of jobs name an option by its field, as in "option shot_rate".

/// The preset of a calibration or plan where nothing names another.
inline constexpr const char* kUsualSensor = "mid-40";

/// Whether a recording tells which type of sensor made it.
bool names_its_sensor(const recordings::RecordingHeader& header);

/// The sensor to start from.
/// @param name_or_path  as sensors::load_sensor; empty takes the built-in preset of the type that
///                      the recording names, a Mid-40's where it names none
/// @throws InvalidArgument when there is no preset of that type; as sensors::load_sensor
sensors::Sensor chosen_sensor(const std::string& name_or_path,
                              const recordings::RecordingHeader& header);

/// Parameters to hold: by name, at a value if there is one (SI units), at the sensor's otherwise.
using HeldParameters = std::vector<std::pair<std::string, std::optional<double>>>;

/// Sets the values of held parameters. @return their names
/// @throws InvalidArgument for unknown names, values out of bounds, and values of other parameters
///         than those of the prisms
std::vector<std::string> hold(const HeldParameters& held, sensors::Sensor& sensor);

}  // namespace risley::jobs
