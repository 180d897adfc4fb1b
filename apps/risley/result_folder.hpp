// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

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

/// As require_apart(), for a verb that writes a folder for results.
/// @param states  names of files of rotor states
void require_folder_apart(const CommonOptions& common, const std::string& folder,
                          std::vector<std::string> states);

/// Writes a page. @throws FileError, also if it would overwrite a file that risley did not write
void write_page_file(const std::string& path, const std::string& html);

/// report.json and the page report.html.
std::vector<jobs::NamedText> report_texts(const report::Report& report);

}  // namespace risley::app
