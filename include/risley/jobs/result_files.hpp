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
/// cancelled, none, and results of an earlier run stay unchanged; a folder that it created for them
/// is then removed, too. Results of an earlier run that this one does not replace, such as the
/// calibration when the numbers did not converge, would not match: they are renamed
/// calibration.earlier.yaml and so on. Files that risley did not write are neither moved nor
/// replaced. A file INCOMPLETE in a folder means that a run was stopped while renaming its files.
struct ResultFiles {
  std::string folder;  ///< calibration.yaml, states.nc; empty: nothing is written
  StatesRows states = StatesRows::knots;
  Provenance provenance;  ///< goes into the files, together with the inputs' SHA-256
};

/// A further text file of the folder.
struct NamedText {
  std::string name, text;
};

/// The file with the numbers of a result.
inline constexpr const char* kCalibrationFile = "calibration.yaml";

/// Its path in a result folder; empty without one, or without a folder.
/// @throws FileError as require_settled()
std::optional<std::string> calibration_in(const std::string& folder);

/// Rejects results that may come from different runs, or that a run is replacing.
/// @param result  a folder of results, or a file in one  @throws FileError
void require_settled(const std::string& result);

/// Whether risley wrote a file, by its beginning; a trajectory, which has no mark, counts if its
/// mount is beside it. Also true if the file does not exist.
bool is_own_result(const std::string& file);
/// @throws FileError unless it is_own_result(), because a new result would replace it
void require_own_result(const std::string& file);

/// Marks a folder with files that may come from different runs.
inline constexpr const char* kIncomplete = "INCOMPLETE";

}  // namespace risley::jobs
