// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "result_folder.hpp"

#include <filesystem>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"

#include "option_names.hpp"

namespace risley::app {

jobs::Provenance provenance_of(const CommonOptions& common) {
  return {{"command", common.command},
          {"version", RISLEY_VERSION},
          {"seed", std::to_string(common.seed)}};
}

jobs::ResultFiles result_files(const std::string& folder, const std::string& states,
                               const CommonOptions& common) {
  jobs::ResultFiles files{folder, jobs::StatesRows::knots, provenance_of(common)};
  if (states == "all") files.states = jobs::StatesRows::all;
  if (states == "none") files.states = jobs::StatesRows::none;
  return files;
}

void make_result_folder(const std::string& folder) {
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  if (code || !std::filesystem::is_directory(folder)) {
    throw FileError(
        folder, {},
        fmt::format("cannot be made a folder: {}", code ? code.message() : "a file has this name"));
  }
}

void write_report_of(const report::Report& report, const std::string& folder) {
  const std::filesystem::path place(folder);
  report::write_report((place / "report.json").string(), report);
  io::write_text_file((place / "report.html").string(), page_of(report));
}

std::string page_of(const report::Report& report) {
  return with_flags(report::report_page(report));
}

}  // namespace risley::app
