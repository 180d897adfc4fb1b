// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/jobs/pattern_details.hpp"
#include "risley/jobs/provenance.hpp"

namespace risley::report {

/// One self-contained HTML page of a scan pattern: the rosette as it grows, its coverage of the
/// field of view, and its prisms.
/// @param provenance  how to reproduce it: name and value pairs
std::string pattern_page(const jobs::PatternDetails& details, const jobs::Provenance& provenance);

}  // namespace risley::report
