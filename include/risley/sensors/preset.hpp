// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/sensors/sensor.hpp"

namespace risley::sensors {

/// Names of the presets inside the library, sorted.
std::vector<std::string> builtin_preset_names();

/// The file of a built-in preset, comments included.
/// @throws InvalidArgument for an unknown name; as load_sensor()
std::string builtin_preset_text(const std::string& name);

/// The text of a preset under another name, as a start for a new one: everything else stays
/// unchanged, comments included.
/// @param name_or_path  of the original, as load_sensor()
/// @throws as load_sensor(), and InvalidArgument for a name that is empty, longer than 64
/// characters or contains characters other than letters, digits, hyphens, underscores and points
std::string copied_preset_text(const std::string& name_or_path, const std::string& new_name);

/// A sensor from a built-in name ("mid-40") or from a preset file (a path that exists, or ends in
/// .yaml). A calibration result is a preset with a covariance: the same schema.
/// @throws FileError (with the line) for a file that breaks the schema: unknown or missing field,
/// wrong unit, value out of bounds, covariance that is not symmetric and positive definite
/// @throws InvalidArgument for an unknown name; the message lists the known ones and the one that
/// may have been meant
Sensor load_sensor(const std::string& name_or_path);

/// Reads preset text: one YAML map, version first (risley_preset: 1). A physical value reads
/// {value, unit, sigma, source}, where sigma, in the same unit, and source come together or not at
/// all; 0 stands for an unknown divergence or size. A value of all prisms has its shared name or
/// the prisms' own names. combination says which of combinations, a list of
/// {angular_velocity_deg_per_s: [prisms], face_order}, the parameters are of. covariance: {names,
/// matrix}, element [i][j] in the unit of names[i] times that of names[j], so degrees as everywhere
/// in files.
/// @param path  for messages only
/// @throws FileError with the line
Sensor parse_preset(const std::string& text, const std::string& path);

/// Writes the schema that parse_preset reads. Numbers keep all their digits, so reading the text
/// gives the same sensor and writing it again gives the same text.
/// @throws InvalidArgument for non-finite numbers, noise, limits and rates that the schema does not
/// allow, a combination that does not exist or a covariance of the wrong size
std::string preset_text(const Sensor& sensor);

}  // namespace risley::sensors
