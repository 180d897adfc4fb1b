// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::io {

/// SHA-256 of a file's bytes as 64 hexadecimal digits. @throws FileError
std::string sha256_of_file(const std::string& path);

}  // namespace risley::io
