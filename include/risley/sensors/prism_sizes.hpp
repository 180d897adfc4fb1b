// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "risley/optics/beam_origin.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::sensors {

/// The size of that name, one that all prisms share or a prism's own; empty for other names.
/// @throws InvalidArgument for a number of prisms that no train has
std::optional<PrismSize> find_prism_size(std::string_view name, int prisms);

/// Value of a size, m; of one that all share, the first prism's. 0 where the sensor has none.
double prism_size(const Sensor& sensor, const PrismSize& size);

/// Standard deviation of a size by what is known of it, m, what was held included; 0 where nothing
/// is.
double prism_size_sigma(const Sensor& sensor, const PrismSize& size);

/// The sizes whose errors a sensor states: those in its covariance, and of the others those with
/// a sigma. A covariance that names sizes of a kind, thickness or spacing, says all of this kind.
std::vector<PrismSize> uncertain_prism_sizes(const Sensor& sensor);

}  // namespace risley::sensors
