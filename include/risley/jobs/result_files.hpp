// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "risley/jobs/provenance.hpp"

namespace risley::jobs {

/// Which rotor states are written.
enum class StatesRows {
  none,
  knots,  ///< one shot per knot (batch estimator), or the shots used (filter)
  all,    ///< all shots
};

/// Where a job leaves its results. All appear together at its end, or, when it fails or is
/// cancelled, none, and what an earlier run left stays as it is; a folder that it made for them is
/// gone then, too. Results of an earlier run that this one has no successor for, such as the
/// calibration when the numbers did not converge, would belong to other numbers: they stay under
/// the names calibration.earlier.yaml and so on. Files that risley did not write are neither moved
/// nor replaced. A folder with a file INCOMPLETE was left by a run
/// that was stopped while it gave the files their names.
struct ResultFiles {
  std::string folder;  ///< calibration.yaml, states.nc; empty: nothing is written
  StatesRows states = StatesRows::knots;
  Provenance provenance;  ///< goes into the files, together with the inputs' SHA-256
};

/// A text that is to stand in the folder, too.
struct NamedText {
  std::string name, text;
};

/// The file with the numbers of a result.
inline constexpr const char* kCalibrationFile = "calibration.yaml";

/// Its path in a result folder; empty where there is none, or no folder.
/// @throws FileError as require_settled()
std::optional<std::string> calibration_in(const std::string& folder);

/// Refuses results that may be of different runs, or that a run is replacing.
/// @param result  a folder of results, or a file in one  @throws FileError
void require_settled(const std::string& result);

/// Whether risley wrote a file, which says so at its beginning; a trajectory, which does not, where
/// the mount that it came with stands beside it. Also true where there is no file.
bool is_own_result(const std::string& file);
/// @throws FileError unless it is_own_result(), as a new result would replace it
void require_own_result(const std::string& file);

/// The file that marks a folder whose files may be of different runs.
inline constexpr const char* kIncomplete = "INCOMPLETE";

}  // namespace risley::jobs
