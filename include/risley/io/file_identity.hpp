// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <compare>
#include <optional>
#include <string>

#include <sys/types.h>

namespace risley::io {

/// Who a file is, by whatever names and links.
struct FileIdentity {
  dev_t device = 0;
  ino_t number = 0;

  auto operator<=>(const FileIdentity&) const = default;
};

/// Of a file, folder or device; empty where nothing has that name.
std::optional<FileIdentity> file_identity(const std::string& path);

}  // namespace risley::io
