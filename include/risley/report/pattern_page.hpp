// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/jobs/pattern_details.hpp"
#include "risley/jobs/provenance.hpp"

namespace risley::report {

/// One self-contained HTML page of a scan pattern: the rosette as it grows, how it fills the field
/// of view, and the prisms that make it.
/// @param provenance  how to make it again: name and value pairs
std::string pattern_page(const jobs::PatternDetails& details, const jobs::Provenance& provenance);

}  // namespace risley::report
