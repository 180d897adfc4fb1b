// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/calibration/flight_judgement.hpp"
#include "risley/jobs/calibrate_flight.hpp"

namespace risley::app {

/// The lines on the datum and the undetermined parameters.
void print_judgement(const calibration::FlightJudgement& judgement);

void print_flight(const jobs::CalibratedFlight& outcome);

}  // namespace risley::app
