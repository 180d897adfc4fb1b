// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/calibration/calibrate.hpp"

#include "calibration/belief.hpp"
#include "calibration/held.hpp"

namespace risley::calibration {

/// The sensor as a calibration knows it: adjusted optics with the joint covariance of what was
/// adjusted and what was held, and what the recordings show of the rotors and of what the prisms
/// are made of. All but its serial number.
/// @param result  with free parameters, covariance, range offset sigma, variance factor and changes
///                by what was held
/// @param held    what was held and may be off
sensors::Sensor calibrated_sensor(const CalibrationOptions& options, const Belief& belief,
                                  const PlanarSolution& solution, const Calibration& result,
                                  const Held& held);

}  // namespace risley::calibration
