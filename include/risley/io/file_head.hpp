// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The beginning of a file, from which its format is recognised.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "risley/io/block_file.hpp"

namespace risley::io {

/// The first bytes of a file; for a text as LineReader reads tables: UTF-8 in plain dialect.
/// @throws FileError when it cannot be read
std::string read_file_head(const InputFile& file, std::size_t bytes);

/// Recognises a stand-in for the expected file: its kind and how to get the file. Compressed files,
/// pointers of Git LFS and git-annex, web pages saved in a file's place.
/// @param head  as returned by read_file_head()
std::optional<std::string> stands_for_another(const std::string& path, std::string_view head);

}  // namespace risley::io
