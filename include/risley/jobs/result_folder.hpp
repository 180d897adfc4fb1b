// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <list>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/io/folder_lock.hpp"
#include "risley/io/output_file.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// A folder for results in preparation, see ResultFiles. Only one run at a time has it; files that
/// risley did not write stay unchanged. Without a name it does nothing.
class ResultFolder {
 public:
  /// Creates the folder, before an hour of computation. @throws FileError, also if another run has
  /// locked it
  explicit ResultFolder(const std::string& folder);
  /// Removes what was not committed.
  ~ResultFolder();
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder& operator=(const ResultFolder&) = delete;

  explicit operator bool() const { return !folder_.empty(); }

  /// Rotor states of an estimate, see write_states().
  void add_states(const std::string& name, const estimation::Estimate& estimate, StatesRows rows,
                  const Provenance& provenance, const Progress& progress);
  /// calibration.yaml.
  void add_calibration(const sensors::Sensor& sensor);
  /// Any other file.
  void add_text(const NamedText& text);
  /// Gives all files their names.
  /// @return treatment of an earlier run's results, in sentences
  std::vector<Warning> commit();

 private:
  std::string path(const std::string& name) const;
  void write(const std::string& name, const std::string& text);
  /// @throws FileError if it would replace a file that risley did not write
  io::OutputFile& output(const std::string& name);
  /// Results of an earlier run that this one does not replace, by name.
  std::vector<std::string> left_over() const;

  std::string folder_;
  bool made_ = false, committed_ = false;
  std::optional<io::FolderLock> lock_;
  std::list<io::OutputFile> files_;
};

}  // namespace risley::jobs
