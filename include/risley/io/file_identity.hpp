// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>

#include <sys/types.h>

namespace risley::io {

/// Who a file is, by whatever names and links: device and number on it.
using FileIdentity = std::pair<dev_t, ino_t>;

/// Of a file, folder or device; empty where nothing has that name.
std::optional<FileIdentity> file_identity(const std::string& path);

}  // namespace risley::io
