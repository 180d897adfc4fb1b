// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/jobs/compare_results.hpp"
#include "risley/jobs/provenance.hpp"
#include "risley/report/report_file.hpp"

namespace risley::report {

/// One of two results on a page.
struct ComparedResult {
  std::string name;  ///< such as its folder
  const Report& report;
};

/// One self-contained HTML page of two results side by side: their verdicts, the difference of
/// their beams, and every parameter with its difference.
/// @param provenance  how to reproduce it: name and value pairs
std::string comparison_page(const ComparedResult& a, const ComparedResult& b,
                            const jobs::ResultComparison& comparison,
                            const jobs::Provenance& provenance);

}  // namespace risley::report
