// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "risley/core/progress.hpp"
#include "risley/io/block_file.hpp"

namespace risley::hashes {

/// SHA-256 of a file's bytes as 64 hexadecimal digits. @throws FileError, Cancelled
std::string sha256_of_file(const io::InputFile& file, const Progress& progress = {});

/// SHA-256 of a text as 64 hexadecimal digits.
std::string sha256(std::string_view text);

/// SHA-256 of a text in base64, as browsers expect it.
std::string sha256_base64(std::string_view text);

}  // namespace risley::hashes
