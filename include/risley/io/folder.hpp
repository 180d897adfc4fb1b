// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::io {

/// Creates a folder and its parents if missing. @return whether it was missing
/// @throws FileError
bool make_folder(const std::string& path);

/// A folder for temporary files, under an unpredictable name and accessible only to this user: in
/// TMPDIR if set, otherwise in memory (/dev/shm) if there is plenty of room, otherwise in the
/// system's place (/tmp). The destructor removes it with its contents.
class TemporaryFolder {
 public:
  /// @param bytes  approximate largest total size of its files
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
