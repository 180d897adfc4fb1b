// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/sensors/sensor.hpp"

namespace risley::sensors {

/// Names of the presets that travel inside the library, sorted.
std::vector<std::string> builtin_preset_names();

/// A sensor from a built-in name ("mid-40") or from a preset file (a path that exists, or ends in
/// .yaml). A calibration result is a preset with a covariance: the same schema.
/// @throws FileError (with the line) for a file that breaks the schema: unknown or missing field,
///         wrong unit, value out of bounds, covariance that is not symmetric and positive
/// @throws InvalidArgument for an unknown name; the message lists the known ones
Sensor load_sensor(const std::string& name_or_path);

/// Reads preset text. @param path  for messages only
Sensor parse_preset(const std::string& text, const std::string& path);

/// Writes the schema that parse_preset reads. Numbers keep all their digits, so reading the text
/// gives the same sensor and writing it again gives the same text.
std::string preset_text(const Sensor& sensor);

}  // namespace risley::sensors
