// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>

#include <sys/types.h>

namespace risley::io {

/// Identifies a file independently of names and links: its device and its number there.
using FileIdentity = std::pair<dev_t, ino_t>;

/// Of a file, folder or device; empty if the name does not exist.
std::optional<FileIdentity> file_identity(const std::string& path);

}  // namespace risley::io
