// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/core/warning.hpp"

namespace risley::app {

/// Warnings on stderr.
void log_warnings(const std::vector<Warning>& warnings);
/// The same, each with the name of the file.
void log_warnings(const std::string& file, const std::vector<Warning>& warnings);

}  // namespace risley::app
