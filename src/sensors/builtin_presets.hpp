// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

namespace risley::sensors {

/// A preset file of presets/ inside the library.
struct BuiltinPreset {
  const char* name;  ///< of the file, without its ending
  const char* text;
};

/// All of them, defined by the source that cmake/RisleyPresets.cmake writes.
const std::vector<BuiltinPreset>& builtin_presets();

}  // namespace risley::sensors
