// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "risley/optics/beam_origin.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::sensors {

/// The size of that name, common to all prisms or a prism's own; empty for other names.
/// @throws InvalidArgument for an unsupported number of prisms
std::optional<PrismSize> find_prism_size(std::string_view name, int prisms);

/// Value of a size, m; of a common one, the first prism's. 0 if the sensor has none.
double prism_size(const Sensor& sensor, const PrismSize& size);

/// Standard deviation of a size, m, including the uncertainty of held values; 0 if not stated.
double prism_size_sigma(const Sensor& sensor, const PrismSize& size);

/// The sizes with stated errors: those in a sensor's covariance, and of the others those with a
/// sigma. A covariance that names sizes of a kind, thickness or spacing, covers all of this kind.
std::vector<PrismSize> uncertain_prism_sizes(const Sensor& sensor);

}  // namespace risley::sensors
