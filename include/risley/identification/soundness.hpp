// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/identification/identify.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::identification {

/// Reasons why trains that fit a scan best may still not be the sensor's.
struct Doubt {
  std::string words;  ///< empty: there is none
  /// The train cannot be the sensor's; otherwise the scan does not determine it.
  bool refuted = false;
};

/// Checks a train that fits: its parameters must be within a preset's bounds, every prism must be
/// detectable, and the residuals must be noise and not a pattern.
/// @param sensor  that corresponds to the best hypothesis
Doubt doubt_of(const Identification& found, const sensors::Sensor& sensor);

}  // namespace risley::identification
