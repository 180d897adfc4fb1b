// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/jobs/compare_units.hpp"
#include "risley/jobs/provenance.hpp"

namespace risley::report {

/// One self-contained HTML page of units over time and against each other: whether any changed, the
/// pairs that show it, the units that differ from the others, and every parameter over the results.
/// @param provenance  how to reproduce it: name and value pairs
std::string units_page(const jobs::ComparedUnits& compared, const jobs::Provenance& provenance);

}  // namespace risley::report
