// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/cloud/point_distribution.hpp"
#include "risley/jobs/provenance.hpp"

namespace risley::report {

/// One self-contained HTML page of how points lie on the ground: densities across every strip and
/// on the map, gaps, coverage.
/// @param flight      what the points are of, text
/// @param provenance  how to make it again: name and value pairs
std::string distribution_page(const cloud::PointDistributionSummary& distribution,
                              const std::string& flight, const jobs::Provenance& provenance);

}  // namespace risley::report
