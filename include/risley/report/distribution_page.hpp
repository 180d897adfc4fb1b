// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/cloud/point_distribution.hpp"
#include "risley/jobs/provenance.hpp"

namespace risley::report {

/// One self-contained HTML page on the distribution of points on the ground: densities across every
/// strip and on the map, gaps, coverage.
/// @param flight  description of the points' flight, text
/// @param provenance  how to reproduce it: name and value pairs
std::string distribution_page(const cloud::PointDistributionSummary& distribution,
                              const std::string& flight, const jobs::Provenance& provenance);

}  // namespace risley::report
