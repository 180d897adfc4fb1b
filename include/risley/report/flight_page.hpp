// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/report/flight_report.hpp"

namespace risley::report {

/// One self-contained HTML page (Apache ECharts included, no network): the verdict first, then
/// mount and prisms, what the flight does not tell, the strips on each other before and after, the
/// ground, residuals and the trajectory's corrections along time, correlations, time audit and
/// provenance. The page says where diagrams were thinned. What is not finite shows as a dash.
std::string flight_page(const FlightReport& report);

}  // namespace risley::report
