// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/core/text.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::app {

/// Warnings on stderr, each with the name of the file.
void log_warnings(const std::string& file, const std::vector<recordings::ReadWarning>& warnings);

}  // namespace risley::app
