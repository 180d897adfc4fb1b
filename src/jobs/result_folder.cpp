// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/result_folder.hpp"

#include <filesystem>
#include <fstream>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/jobs/states_file.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::jobs {

namespace fs = std::filesystem;

ResultFolder::ResultFolder(const std::string& folder) : folder_(folder) {
  if (folder_.empty()) return;
  std::error_code code;
  made_ = fs::create_directories(folder_, code);
  if (code || !fs::is_directory(folder_)) {
    throw FileError(
        folder_, {},
        fmt::format("cannot be made a folder: {}", code ? code.message() : "a file has this name"));
  }
}

ResultFolder::~ResultFolder() {
  files_.clear();
  std::error_code ignored;
  if (made_ && !committed_) fs::remove(folder_, ignored);  // only if it is empty
}

void ResultFolder::add_states(const std::string& name, const estimation::Estimate& estimate,
                              StatesRows rows, const Provenance& provenance,
                              const Progress& progress) {
  if (folder_.empty() || rows == StatesRows::none) return;
  const bool all = rows == StatesRows::all;
  StatesContent content;
  content.prisms = estimate.sensor.prisms();
  content.rows = all ? estimate.series.size() : estimate.states.size();
  content.block = [&](estimation::ShotRange shots) {
    progress.check();
    return all ? estimation::states_of_shots(estimate, shots)
               : estimation::rows_of(estimate.states, shots);
  };
  content.residuals_over_angle = estimate.residuals_over_angle;
  write_states(files_.emplace_back(path(name)), content, provenance);
}

void ResultFolder::add_calibration(const sensors::Sensor& sensor) {
  if (folder_.empty()) return;
  const io::OutputFile& file = files_.emplace_back(path("calibration.yaml"));
  std::ofstream stream(file.temporary_path(), std::ios::binary);
  stream << sensors::preset_text(sensor);
  stream.close();
  if (!stream) throw FileError(file.path(), {}, "cannot be written");
}

void ResultFolder::remove_calibration() const {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove(path("calibration.yaml"), ignored);
}

void ResultFolder::commit() {
  committed_ = true;
  for (io::OutputFile& file : files_) file.commit();
}

std::string ResultFolder::path(const std::string& name) const {
  return (fs::path(folder_) / name).string();
}

}  // namespace risley::jobs
