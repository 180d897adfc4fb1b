// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "result_folder.hpp"

#include <filesystem>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/sha256.hpp"
#include "risley/io/text_file.hpp"
#include "risley/report/states_file.hpp"

namespace risley::app {

report::Provenance provenance_of(const CommonOptions& common,
                                 const std::vector<std::string>& inputs) {
  report::Provenance result = {{"command", common.command},
                               {"version", RISLEY_VERSION},
                               {"seed", std::to_string(common.seed)}};
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const std::string name = i == 0 ? "input" : fmt::format("input_{}", i + 1);
    result.emplace_back(name, inputs[i]);
    result.emplace_back(name + "_sha256", io::sha256_of_file(inputs[i]));
  }
  return result;
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

void remove_calibration(const std::string& folder) {
  if (folder.empty()) return;
  std::error_code ignored;
  std::filesystem::remove(std::filesystem::path(folder) / "calibration.yaml", ignored);
}

void write_states_of(const estimation::Estimate& estimate, const std::string& which,
                     const std::string& path, const report::Provenance& provenance) {
  const bool all = which == "all";
  report::StatesContent content;
  content.prisms = estimate.sensor.prisms();
  content.rows = all ? estimate.series.size() : estimate.states.size();
  content.block = [&](estimation::ShotRange rows) {
    return all ? estimation::states_of_shots(estimate, rows)
               : estimation::rows_of(estimate.states, rows);
  };
  content.residuals_over_angle = estimate.residuals_over_angle;
  report::write_states(path, content, provenance);
}

report::ReportedRecording reported_recording(const std::string& path, const RecordingInput& input) {
  const recordings::RecordingHeader& header = input.reader->header();
  return {std::filesystem::path(path).filename().string(), header.format,
          to_string(header.time_reference), input.audit};
}

void write_report_of(const report::Report& report, const std::string& folder) {
  const std::filesystem::path place(folder);
  report::write_report((place / "report.json").string(), report);
  io::write_text_file((place / "report.html").string(), report::report_page(report));
}

}  // namespace risley::app
