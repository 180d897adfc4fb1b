// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "risley/io/file_identity.hpp"

namespace risley::io {

/// A folder that one writer has for itself. The kernel takes the lock back when its owner ends in
/// whatever way, and leaves no file behind. File systems without such locks have none.
class FolderLock {
 public:
  /// @throws FileError where another writer has it, in this process or another
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int folder_ = -1;
  std::optional<FileIdentity> identity_;
};

/// Whether another process has a folder for itself.
bool is_locked_by_other(const std::string& folder);

}  // namespace risley::io
