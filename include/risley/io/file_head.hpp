// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The beginning of a file, by which its format is recognised.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "risley/io/block_file.hpp"

namespace risley::io {

/// The first bytes of a file; of a text they are as LineReader reads tables: UTF-8 in plain
/// dialect.
/// @throws FileError when it cannot be read
std::string read_file_head(const InputFile& file, std::size_t bytes);

/// Where a file is not what its name says but something that stands for it: what it is and how one
/// gets at the file. Whole files that were compressed, pointers of Git LFS and git-annex, pages of
/// the web that were saved in a file's place.
/// @param head  as read_file_head() gives it
std::optional<std::string> stands_for_another(const std::string& path, std::string_view head);

}  // namespace risley::io
