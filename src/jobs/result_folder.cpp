// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/result_folder.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <regex>

#include <fcntl.h>
#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/folder.hpp"
#include "risley/io/text_file.hpp"
#include "risley/jobs/states_file.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::jobs {

namespace fs = std::filesystem;

namespace {

/// Renames a file to an unused name: calibration.earlier.yaml, calibration.earlier-2.yaml, ...
std::string set_aside(const fs::path& file) {
  for (int number = 1;; ++number) {
    fs::path aside = file;
    aside.replace_extension(fmt::format(
        ".earlier{}{}", number == 1 ? "" : fmt::format("-{}", number), file.extension().string()));
    if (fs::exists(fs::symlink_status(aside))) continue;
    if (::renameat2(AT_FDCWD, file.c_str(), AT_FDCWD, aside.c_str(), RENAME_NOREPLACE) == 0) {
      return aside.string();
    }
    if (errno == EEXIST) continue;
    // A file system that does not support it.
    if (errno != EINVAL || ::rename(file.c_str(), aside.c_str()) != 0) {
      throw FileError(aside.string(), {},
                      fmt::format("cannot be written: {}", std::strerror(errno)));
    }
    return aside.string();
  }
}

}  // namespace

ResultFolder::ResultFolder(const std::string& folder) : folder_(folder) {
  if (folder_.empty()) return;
  made_ = io::make_folder(folder_);
  lock_.emplace(folder_);
}

ResultFolder::~ResultFolder() {
  files_.clear();
  lock_.reset();
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
  write_states(output(name), content, provenance);
}

void ResultFolder::add_calibration(const sensors::Sensor& sensor) {
  if (folder_.empty()) return;
  write(kCalibrationFile, sensors::preset_text(sensor));
}

void ResultFolder::add_text(const NamedText& text) {
  if (!folder_.empty()) write(text.name, text.text);
}

std::vector<Warning> ResultFolder::commit() {
  std::vector<Warning> moves;
  if (folder_.empty()) return moves;
  for (io::OutputFile& file : files_) file.sync();
  committed_ = true;
  // From here on the folder contains files of two runs.
  io::write_text_file(path(kIncomplete),
                      "The files beside this one may come from different runs: the last run was "
                      "stopped while it\nmoved its results into place. Run it again.\n");
  for (const std::string& name : left_over()) {
    const std::string aside = set_aside(path(name));
    warn(moves, kWarning.results_renamed,
         "{} is from an earlier run, and this run wrote none: it was renamed {}", path(name),
         aside);
  }
  for (io::OutputFile& file : files_) file.commit();
  std::error_code code;
  if (!fs::remove(path(kIncomplete), code)) {
    throw FileError(path(kIncomplete), {}, fmt::format("cannot be removed: {}", code.message()));
  }
  return moves;
}

void ResultFolder::write(const std::string& name, const std::string& text) {
  io::write_text(output(name), text);
}

io::OutputFile& ResultFolder::output(const std::string& name) {
  require_own_result(path(name));
  return files_.emplace_back(path(name));
}

std::vector<std::string> ResultFolder::left_over() const {
  static const std::regex results(
      "(calibration\\.yaml|mount\\.yaml|reproduction\\.json|trajectory\\.csv|"
      "states(_[0-9]+)?\\.nc|report\\.(json|html))");
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_)) {
    const std::string name = entry.path().filename().string();
    const bool replaced =
        std::any_of(files_.begin(), files_.end(),
                    [&](const io::OutputFile& file) { return file.path() == path(name); });
    if (!replaced && std::regex_match(name, results) && is_own_result(path(name))) {
      names.push_back(name);
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string ResultFolder::path(const std::string& name) const {
  return (fs::path(folder_) / name).string();
}

std::optional<std::string> calibration_in(const std::string& folder) {
  std::error_code ignored;
  const fs::path file = fs::path(folder) / kCalibrationFile;
  if (!fs::is_regular_file(file, ignored)) return std::nullopt;
  require_settled(folder);
  return file.string();
}

void require_settled(const std::string& result) {
  std::error_code ignored;
  fs::path folder = result;
  if (!fs::is_directory(folder, ignored)) folder = folder.parent_path();
  if (folder.empty()) folder = ".";
  if (fs::exists(folder / kIncomplete, ignored)) {
    throw FileError((folder / kIncomplete).string(), {},
                    "says that the files beside it may be from different runs, because the last "
                    "one was stopped: run it again");
  }
  if (io::is_locked_by_other(folder.string())) {
    throw FileError(folder.string(), {},
                    "a run is writing its results there: wait until it has ended");
  }
}

bool is_own_result(const std::string& file) {
  std::error_code ignored;
  const fs::file_status status = fs::status(file, ignored);
  if (!fs::exists(status)) return true;
  if (!fs::is_regular_file(status)) return false;
  if (fs::path(file).filename() == "trajectory.csv") {
    const fs::path mount = fs::path(file).parent_path() / "mount.yaml";
    return fs::exists(mount, ignored) && is_own_result(mount.string());
  }
  std::string head(4096, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(stream.gcount()));
  return head.find("risley") != std::string::npos;
}

void require_own_result(const std::string& file) {
  if (is_own_result(file)) return;
  throw FileError(
      file, {},
      "is not a result of risley, and would be overwritten: move it, or give another folder");
}

}  // namespace risley::jobs
