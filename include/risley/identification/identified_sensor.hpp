// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "risley/identification/identify.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::identification {

/// A sensor identified from its scan.
struct IdentifiedSensor {
  sensors::Sensor sensor;
  /// Shots of the sensor for each row of the recording, 1 if there is no sign of missing ones. Only
  /// shots that share a time reveal the sensor's own shots.
  int decimation = 1;
};

/// The best hypothesis as a preset: optics, mean speeds, and the scan from the first shot, so that
/// its row r is the recording's; the frame's turn is not included. Values that directions do not
/// determine, such as limits of range, come from `rest` and are marked as assumed.
/// @param rest  any sensor
IdentifiedSensor identified_sensor(const Identification& identification, const std::string& name,
                                   const sensors::Sensor& rest);

/// A known sensor that matches an identified train.
struct Likeness {
  bool mirrored = false;  ///< the known one is mirrored, or the recording is
  double worst = 0;       ///< largest difference, as a share of the allowed one
};

/// Whether a hypothesis or one of its equivalents is a sensor's train: the same faces, speeds
/// within 3 %, deviations of the prisms within 3 %.
std::optional<Likeness> likeness(const Identification& identification,
                                 const sensors::Sensor& known);

}  // namespace risley::identification
