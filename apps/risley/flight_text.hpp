// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/calibration/flight_judgement.hpp"
#include "risley/jobs/calibrate_flight.hpp"
#include "risley/optics/parameters.hpp"

#include "command.hpp"

namespace risley::app {

/// An unknown of a flight in the unit of its name.
double in_unit_of(const calibration::FlightUnknown& unknown, double value, TrainShape shape);
std::string unit_of(const calibration::FlightUnknown& unknown, TrainShape shape);

/// What a flight tells: "unknowns", "datum", "not_told".
Json judgement_json(const calibration::FlightJudgement& judgement, TrainShape shape);
/// The lines on datum and what is not told.
void print_judgement(const calibration::FlightJudgement& judgement);

/// @param total_time  that the verb took, s
Json flight_json(const jobs::CalibratedFlight& outcome, double total_time);
void print_flight(const jobs::CalibratedFlight& outcome);

}  // namespace risley::app
