// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/report/calibration_report.hpp"
#include "risley/report/estimate_report.hpp"
#include "risley/report/flight_report.hpp"

namespace risley::report {

/// What a page takes for granted of a report that came from a file: known names, lists of equal
/// lengths, numbers where the result converged.
/// @throws FieldError naming the field
void check_report(const EstimateReport& report);
void check_report(const CalibrationReport& report);
void check_report(const FlightReport& report);

}  // namespace risley::report
