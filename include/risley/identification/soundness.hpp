// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/identification/identify.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::identification {

/// Why trains that fit a scan best are nevertheless not those of the sensor.
struct Doubt {
  std::string words;  ///< empty: there is none
  /// The train cannot be the sensor's; otherwise the scan does not determine it.
  bool refuted = false;
};

/// Looks at a train that fits: its parameters have to be possible, which a preset's are, every
/// prism has to be seen, and what is left has to be noise and not a pattern.
/// @param sensor  that the best hypothesis amounts to
Doubt doubt_of(const Identification& found, const sensors::Sensor& sensor);

}  // namespace risley::identification
