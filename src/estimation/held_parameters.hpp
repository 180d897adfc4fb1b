// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "risley/estimation/estimate.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// Effect of held parameters that may be off on an estimate, which refers to their held values.
/// With e as error of the held ones the free ones are off by -N_ff^-1 N_fh e, with N the
/// information of the constants after the rotors were eliminated, and the rotors follow both.
/// docs/theory/map.md
/// @param estimate  with solution, series and start; its values are not needed
/// @param sensor  its starting values, with the held parameters' uncertainties
HeldChanges changes_by_held_parameters(const Estimate& estimate, const sensors::Sensor& sensor);

}  // namespace risley::estimation
