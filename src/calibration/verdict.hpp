// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/calibration/calibrate.hpp"
#include "risley/calibration/flight_calibration.hpp"

namespace risley::calibration {

/// Reason why a calibration failed, in words: the adjustment failed, a direction of the parameter
/// space that the walls do not determine, a station or plane that contradicts the data. Empty for a
/// sound one.
std::string reason_of_failure(const Calibration& c, const PlanarSolution& solution);

/// Reason why the ranges are probably not in the assumed unit, if none is stated: their scatter
/// about the walls is unusual for this sensor. Empty where they do not.
/// @param range_noise  expected for the sensor, m
std::string reason_of_ranges(const Calibration& c, const std::vector<RangedRecording>& recordings,
                             double range_noise);

/// Verdict on a calibration: whether its parameters differ from the believed ones by more than
/// chance and held quantities explain once in a thousand times; whether walls became flatter and
/// directions can be expected to be nearer to the truth; and whether the error exceeds the
/// tolerance.
CalibrationVerdict verdict_of(const Calibration& c);

/// The same for a calibration in flight, from the prisms' parameters and the distances between
/// strips.
CalibrationVerdict verdict_of(const FlightCalibration& c);

/// Difference between the directions of the given prisms and of the adjusted ones, over all
/// rotation angles. In flight, the boresight is part of the rotation common to all beams.
PointingError pointing_error_of(const FlightCalibration& c);

/// Error of reported directions: "reported directions are off by 0.4029 ± 0.0013 degree ...".
std::string in_words(const PointingError& error);

/// Held quantities and their values according to the flight: "refractive_index is held at 1.51 +-
/// 1e-06, ...".
std::string in_words(const HeldParameter& held, const sensors::Sensor& sensor);

/// Remarks on a calibration in addition to its numbers.
std::vector<Warning> warnings_of(const Calibration& c, const PlanarSolution& solution,
                                 const std::vector<RangedRecording>& recordings);

}  // namespace risley::calibration
