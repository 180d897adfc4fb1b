// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
#include <string>

#include "risley/io/block_file.hpp"

namespace risley::io {

/// Passes every byte of a file to a function, in pieces and in order.
/// @throws FileError when the file is missing, a folder, or cannot be read to its end
void read_bytes(const std::string& path, const std::function<void(std::span<const char>)>& take);
/// The same for an open file.
void read_bytes(const InputFile& file, const std::function<void(std::span<const char>)>& take);

}  // namespace risley::io
