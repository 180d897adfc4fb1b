// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Comparisons of results with plain numbers, for the pages that show them.
#pragma once

#include <string>
#include <vector>

#include "risley/calibration/datum.hpp"
#include "risley/jobs/compare_results.hpp"

namespace risley::testing {

/// A parameter of a result, SI units. @param sigma  0 where it was held
struct KnownValue {
  std::string name;
  double value = 0, sigma = 0;
};

/// Beams that are off by a number of degrees, shared and in shape, known to a tenth.
calibration::PointingError pointing_error(double total_deg);

/// Two results of one unit, a mid-40, with the same parameters. Its test of change is empty.
jobs::ResultComparison compared(const std::vector<KnownValue>& a, const std::vector<KnownValue>& b,
                                double apart_deg);

/// Makes them results of two units.
void of_two_units(jobs::ResultComparison& comparison);

}  // namespace risley::testing
