// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "risley/calibration/flight_calibration.hpp"

namespace risley::calibration {

/// "east", ..., "tilt about east", ..., "heading". @param correction  from 0, see kCorrections
const char* correction_name(int correction);

/// "the attitudes of the trajectory are late by 5.01 +- 0.02 ms against its positions".
std::string in_words(const AttitudeDelay& delay);

/// "the trajectory jumps by 41 +- 3 mm up at 12.4 s (strip 2), 23 sigmas beyond ...".
/// @param begin_ns  from which times count
std::string in_words(const TrajectoryJump& jump, std::int64_t begin_ns);

/// Deviation of the clock offset from its stated value.
std::string clock_in_words(const FlightCalibration& c);

/// Statement that the trajectory does not fit its stated errors, even after changes.
std::string misfit_in_words(const FlightCalibration& c);

/// The verdict on a flight whose times or trajectory contradict their stated errors; none if they
/// do not.
std::optional<CalibrationVerdict> contradiction_of(const FlightCalibration& c);

}  // namespace risley::calibration
