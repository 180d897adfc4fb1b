// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <variant>

#include "risley/report/calibration_report.hpp"
#include "risley/report/estimate_report.hpp"
#include "risley/report/flight_report.hpp"

namespace risley::report {

/// A report of any kind.
using Report = std::variant<EstimateReport, CalibrationReport, FlightReport>;

/// The text of report.json; numbers that are not finite are null.
std::string report_text(const Report& report);

/// Writes report.json: everything that the report's page says and draws (docs/files.md).
/// Diagrams keep the digits that can be seen. @throws FileError
void write_report(const std::string& path, const Report& report);

/// Reads what write_report wrote. @throws FileError naming the byte where the text breaks off, or
/// the field that is missing or of another kind
Report read_report(const std::string& path);
/// The same of a text. @param path  how errors name it
Report parse_report(const std::string& text, const std::string& path);

/// The page of a report of any kind.
std::string report_page(const Report& report);

/// "estimate" or "calibrate": the verb that made it.
const char* verb_of(const Report& report);

}  // namespace risley::report
