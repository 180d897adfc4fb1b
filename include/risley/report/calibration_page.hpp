// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/report/calibration_report.hpp"

namespace risley::report {

/// One self-contained HTML page (Apache ECharts included, no network): the verdict first, then
/// parameters, datum, walls in three dimensions, what is left of their thickness, views of the
/// points, correlations, time audit and provenance. The page says where diagrams were thinned. What
/// is not finite shows as a dash.
std::string calibration_page(const CalibrationReport& report);

}  // namespace risley::report
