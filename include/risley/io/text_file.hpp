// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::io {

/// Reads a whole file. @throws FileError when it is missing or cannot be read
std::string read_text_file(const std::string& path);

/// Writes a whole file through OutputFile. @throws FileError
void write_text_file(const std::string& path, const std::string& text);

}  // namespace risley::io
