// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/calibration/calibrate.hpp"
#include "risley/calibration/flight_calibration.hpp"

namespace risley::calibration {

/// Why a calibration is none, in words: the adjustment failed, a direction of the parameter space
/// that the walls do not determine, a station or plane that contradicts the data. Empty for a sound
/// one.
std::string reason_of_failure(const Calibration& c, const PlanarSolution& solution);

/// Why the ranges are probably not in the unit that they were taken in, where none is stated: they
/// scatter about the walls unlike this sensor's. Empty where they do not.
/// @param range_noise  that the sensor is known for, m
std::string reason_of_ranges(const Calibration& c, const std::vector<RangedRecording>& recordings,
                             double range_noise);

/// What a calibration comes to: whether its parameters differ from the believed ones by more than
/// chance and what was held explain once in a thousand times; whether walls became flatter and
/// directions can be expected to be nearer to the truth; and whether the error is larger than is
/// tolerated.
CalibrationVerdict verdict_of(const Calibration& c);

/// The same of a calibration in flight, by the prisms' parameters and the distances between strips.
CalibrationVerdict verdict_of(const FlightCalibration& c);

/// How far the directions of the prisms as they were given are from those of the prisms found, over
/// all rotation angles. In flight, the boresight takes part in the rotation that all beams share.
PointingError pointing_error_of(const FlightCalibration& c);

/// How wrong reported directions are: "reported directions are off by 0.4029 ± 0.0013 degree ...".
std::string in_words(const PointingError& error);

/// What is held and what the flight says about it: "refractive_index is held at 1.51 +- 1e-06,
/// ...".
std::string in_words(const HeldParameter& held, const sensors::Sensor& sensor);

/// What a user should know of a calibration beside its numbers.
std::vector<Warning> warnings_of(const Calibration& c, const PlanarSolution& solution,
                                 const std::vector<RangedRecording>& recordings);

}  // namespace risley::calibration
