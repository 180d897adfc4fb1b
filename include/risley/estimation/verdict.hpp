// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::estimation {

/// What an estimate comes to. The codes are stable: scripts read them.
enum class EstimateCode {
  consistent,    ///< directions agree with the sensor's own parameters; not tested on walls
  unusual,       ///< they do, but something is unusual for a healthy unit
  inconsistent,  ///< the model does not describe them
  undecided,     ///< the data cannot decide
};

/// "consistent", ...
const char* to_string(EstimateCode code);

/// The same for people.
struct EstimateVerdict {
  EstimateCode code = EstimateCode::undecided;
  std::string words;  ///< what was found
  std::string to_do;  ///< what follows from it
};

}  // namespace risley::estimation
