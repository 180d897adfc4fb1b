// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "risley/recordings/reader.hpp"

namespace risley::app {

/// Warnings on stderr, each with the name of the file; options in them get the names that users
/// know.
void log_warnings(const std::string& file, std::vector<recordings::ReadWarning>& warnings);

/// 1234567 as "1 234 567".
std::string grouped(std::uint64_t number);

}  // namespace risley::app
