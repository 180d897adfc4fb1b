// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::calibration {

/// What a calibration comes to. The codes are stable: scripts read them.
enum class CalibrationCode {
  as_believed,  ///< walls or strips bear out what the sensor believes of itself
  bent,         ///< the beam goes elsewhere, significantly
  not_better,   ///< parameters moved, and walls are no flatter, strips no closer for it
  undecided,    ///< the data do not tell, or contradict what is stated of them
};

/// "as_believed", ...
const char* to_string(CalibrationCode code);

/// The same for people.
struct CalibrationVerdict {
  CalibrationCode code = CalibrationCode::undecided;
  std::string words;  ///< what was found
  std::string to_do;  ///< what follows from it
};

}  // namespace risley::calibration
