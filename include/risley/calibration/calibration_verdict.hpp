// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::calibration {

/// What a calibration comes to. The codes are stable: scripts read them.
enum class CalibrationCode {
  as_believed,           ///< walls or strips confirm the sensor's own parameters
  off_within_tolerance,  ///< beams differ significantly, but within the tolerance
  bent,                  ///< beams differ significantly and beyond the tolerance
  not_better,            ///< parameters moved, but walls became no flatter, or strips no closer
  undecided,             ///< the data cannot decide, or contradict stated values
};

/// "as_believed", ...
const char* to_string(CalibrationCode code);

/// Whether calibrated directions are nearer to the truth than reported ones beyond reasonable
/// doubt: off_within_tolerance and bent.
bool improves(CalibrationCode code);

/// The same for people.
struct CalibrationVerdict {
  CalibrationCode code = CalibrationCode::undecided;
  std::string words;  ///< what was found
  std::string to_do;  ///< what follows from it
};

}  // namespace risley::calibration
