// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/calibration/calibrate.hpp"

#include "calibration/belief.hpp"
#include "calibration/held.hpp"

namespace risley::calibration {

/// The calibrated sensor: adjusted optics with the joint covariance of adjusted and held
/// quantities, and the recordings' information on the rotors and on the material of the prisms. All
/// but its serial number.
/// @param result  with free parameters, covariance, range offset sigma, variance factor and changes
/// due to held quantities
/// @param held  the held quantities that may be off
sensors::Sensor calibrated_sensor(const CalibrationOptions& options, const Belief& belief,
                                  const PlanarSolution& solution, const Calibration& result,
                                  const Held& held);

}  // namespace risley::calibration
