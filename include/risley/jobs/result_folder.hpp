// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <list>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/io/output_file.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// A folder for results in the making, see ResultFiles. Without a name it does nothing.
class ResultFolder {
 public:
  /// Makes the folder, before an hour of computing. @throws FileError
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
  /// @return what happened to results of an earlier run, in sentences
  std::vector<std::string> commit();

 private:
  std::string path(const std::string& name) const;
  void write(const std::string& name, const std::string& text);
  /// Results of an earlier run that this one does not replace, by name.
  std::vector<std::string> left_over() const;

  std::string folder_;
  bool made_ = false, committed_ = false;
  std::list<io::OutputFile> files_;
};

}  // namespace risley::jobs
