// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::io {

class OutputFile;

/// Reads a whole file. @throws FileError when it is missing, cannot be read, or is longer than the
/// limit for texts read at once
std::string read_text_file(const std::string& path);

/// Writes the contents of a file, which must then be committed. @throws FileError
void write_text(const OutputFile& output, const std::string& text);

/// Writes a whole file through OutputFile. @throws FileError
void write_text_file(const std::string& path, const std::string& text);

}  // namespace risley::io
