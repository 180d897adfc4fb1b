// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/jobs/calibrate_flight.hpp"

#include "command.hpp"

namespace risley::app {

/// @param total_time  that the verb took, s
Json flight_json(const jobs::CalibratedFlight& outcome, double total_time);
void print_flight(const jobs::CalibratedFlight& outcome);

}  // namespace risley::app
