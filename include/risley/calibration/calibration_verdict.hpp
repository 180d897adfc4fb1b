// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::calibration {

/// What a calibration comes to. The codes are stable: scripts read them.
enum class CalibrationCode {
  as_believed,           ///< walls or strips confirm what the sensor believes of itself
  off_within_tolerance,  ///< the beam goes elsewhere, significantly, but less than is tolerated
  bent,                  ///< the beam goes elsewhere, significantly and more than is tolerated
  not_better,            ///< parameters moved, and walls are no flatter, strips no closer for it
  undecided,             ///< the data cannot decide, or contradict what is stated
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
