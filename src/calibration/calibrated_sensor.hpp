// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/calibration/calibrate.hpp"

#include "calibration/belief.hpp"

namespace risley::calibration {

/// The sensor as a calibration knows it: adjusted optics with covariance, and what the recordings
/// tell of the rotors and of what the prisms are made of. All but its serial number.
/// @param result  with free parameters, covariance, range offset sigma and variance factor
sensors::Sensor calibrated_sensor(const CalibrationOptions& options, const Belief& belief,
                                  const PlanarSolution& solution, const Calibration& result);

}  // namespace risley::calibration
