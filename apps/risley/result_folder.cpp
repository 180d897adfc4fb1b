// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "result_folder.hpp"

#include <filesystem>
#include <fstream>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/io/text_file.hpp"

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

void require_folder_apart(const CommonOptions& common, const std::string& folder,
                          std::vector<std::string> states) {
  if (folder.empty()) return;
  std::vector<std::string> outputs = std::move(states);
  outputs.insert(outputs.end(), {"calibration.yaml", "report.json", "report.html"});
  for (std::string& name : outputs) name = (std::filesystem::path(folder) / name).string();
  require_apart(common, outputs);
  // Checked before an hour of computation; some rotor states are not written.
  for (const std::string& name : outputs) {
    if (!name.ends_with(".nc")) jobs::require_own_result(name);
  }
}

void write_page_file(const std::string& path, const std::string& html) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) {
    std::string head(15, '\0');
    std::ifstream(path, std::ios::binary).read(head.data(), 15);
    if (lower_case(head) != "<!doctype html>" || !jobs::is_own_result(path)) {
      throw FileError(path, {},
                      "is not a page of risley, and would be overwritten: give another name");
    }
  }
  io::write_text_file(path, html);
}

std::vector<jobs::NamedText> report_texts(const report::Report& report) {
  return {{"report.json", report::report_text(report)},
          {"report.html", report::report_page(report)}};
}

}  // namespace risley::app
