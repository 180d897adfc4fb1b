// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "risley/estimation/estimate.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// What held parameters that may be off do to an estimate: the data answer for the values that they
/// were held at.
/// With e as error of the held ones the free ones are off by -N_ff^-1 N_fh e, with N the
/// information of the constants after the rotors were eliminated, and the rotors follow both.
/// docs/theory/map.md
/// @param estimate  with solution, series and start; its values need not be there
/// @param sensor    that it started from, with what is known of the held parameters
HeldChanges changes_by_held_parameters(const Estimate& estimate, const sensors::Sensor& sensor);

}  // namespace risley::estimation
