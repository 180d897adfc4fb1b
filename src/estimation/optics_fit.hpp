// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// How well the parameters of a fit are known beforehand.
enum class Priors { of_the_type, wide };

/// Fits train and rotors to shots whose rotors turn evenly, so that they cannot follow shots that
/// are not where they are believed to be.
/// @param series  in the sensor's frame
/// @return the start at its own time with what was found, `residual_rms` included; nothing if the
///         shots do not determine it
std::optional<Start> fit_optics(const AngleSeries& series, const Start& start,
                                const sensors::Sensor& sensor, Priors priors);

}  // namespace risley::estimation
