// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/jobs/compare_series.hpp"
#include "risley/report/report_facts.hpp"

namespace risley::report {

/// One self-contained HTML page of a series of results: whether the unit changed, which pairs say
/// so, and every parameter over the series.
/// @param provenance  how to make it again: name and value pairs
std::string series_page(const jobs::ComparedSeries& series, const Provenance& provenance);

}  // namespace risley::report
