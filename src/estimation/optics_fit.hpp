// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// Prior uncertainty of the parameters of a fit.
enum class Priors { of_the_type, wide };

/// Fits train and rotors to shots with evenly turning rotors, so that they cannot follow shots with
/// wrong times.
/// @param series  in the sensor's frame
/// @return the start at its own time with the fitted values, `residual_rms` included; nothing if
/// the shots do not determine it
std::optional<Start> fit_optics(const AngleSeries& series, const Start& start,
                                const sensors::Sensor& sensor, Priors priors);

}  // namespace risley::estimation
