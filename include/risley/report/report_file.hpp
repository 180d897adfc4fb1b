// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "risley/jobs/calibrate_flight.hpp"
#include "risley/jobs/calibrate_recordings.hpp"
#include "risley/jobs/estimate_recording.hpp"
#include "risley/json/results.hpp"

namespace risley::report {

/// Contents of a result's page: json::of() the result, its diagrams (`charts`), data for the page
/// only (`page`) and its provenance (`provenance`), as docs/schemas/report_file.json describes
/// them. Diagrams are thinned and binned, and state it.
struct Report {
  json::Json json;
  std::string path = "report.json";  ///< for errors
};

/// Of an estimate. @throws InvalidArgument when details were not requested
Report report_of(const jobs::EstimatedRecording& found);
/// Of a calibration on walls. @throws InvalidArgument as above
Report report_of(const jobs::CalibratedRecordings& found);
/// Of a calibration in flight. @throws InvalidArgument as above
Report report_of(const jobs::CalibratedFlight& found);

/// The text of report.json; non-finite numbers are null, and diagrams keep the visible digits.
std::string report_text(const Report& report);

/// @throws FileError naming the byte where the text ends prematurely, or the place that is missing
/// or wrong; for files of versions that are no longer supported
Report read_report(const std::string& path);
/// The same of a text. @param path  how errors name it
Report parse_report(const std::string& text, const std::string& path);

/// One self-contained HTML page (Apache ECharts included, no network), the verdict first.
/// Non-finite numbers appear as a dash. @throws FileError as parse_report()
std::string report_page(const Report& report);

/// "estimate" or "calibrate": the verb that made it.
std::string verb_of(const Report& report);

}  // namespace risley::report
