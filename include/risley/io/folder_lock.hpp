// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "risley/io/file_identity.hpp"

namespace risley::io {

/// A folder locked by one writer. The kernel releases the lock however its owner ends, and no file
/// remains. File systems without such locks have none.
class FolderLock {
 public:
  /// @throws FileError if another writer has it, in this process or another
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int folder_ = -1;
  std::optional<FileIdentity> identity_;
};

/// Whether another process has locked a folder.
bool is_locked_by_other(const std::string& folder);

}  // namespace risley::io
