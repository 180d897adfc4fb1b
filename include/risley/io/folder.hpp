// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::io {

/// Makes a folder with those above it where it is missing. @return whether it was missing
/// @throws FileError
bool make_folder(const std::string& path);

/// A folder for temporary files, under an unpredictable name and for this user
/// alone: in TMPDIR where that is set, otherwise in memory (/dev/shm) where there is plenty of
/// room, otherwise where the system has such files (/tmp). The destructor removes it with all that
/// is in it.
class TemporaryFolder {
 public:
  /// @param bytes  that its files may have at the same time, roughly
  /// @throws FileError
  explicit TemporaryFolder(double bytes);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }  ///< without a slash at its end

 private:
  std::string path_;
};

}  // namespace risley::io
