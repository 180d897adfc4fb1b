// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/core/progress.hpp"

namespace risley::io {

/// SHA-256 of a file's bytes as 64 hexadecimal digits. @throws FileError, Cancelled
std::string sha256_of_file(const std::string& path, const Progress& progress = {});

}  // namespace risley::io
