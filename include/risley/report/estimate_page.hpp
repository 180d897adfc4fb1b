// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/report/estimate_report.hpp"

namespace risley::report {

/// One self-contained HTML page (Apache ECharts included, no network): the verdict first, then
/// parameters, what is unobservable, speeds, residuals, scan pattern, correlations, time audit and
/// provenance. The page says where diagrams were thinned.
std::string estimate_page(const EstimateReport& report);

}  // namespace risley::report
