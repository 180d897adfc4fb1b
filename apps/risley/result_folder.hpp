// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/jobs/result_files.hpp"
#include "risley/report/report_file.hpp"

#include "command.hpp"

namespace risley::app {

/// {"command", ...}, {"version", ...}, {"seed", ...}.
jobs::Provenance provenance_of(const CommonOptions& common);

/// Outputs of a verb that writes calibration.yaml and rotor states.
/// @param states  value of --states
jobs::ResultFiles result_files(const std::string& folder, const std::string& states,
                               const CommonOptions& common);

/// Makes a folder for results, before an hour of computing. @throws FileError
void make_result_folder(const std::string& folder);

/// report.json and the page report.html in a folder for results.
void write_report_of(const report::Report& report, const std::string& folder);
/// The page; what it says of options is in words of the command.
std::string page_of(const report::Report& report);

}  // namespace risley::app
