// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::io {

/// An output that appears under its final name only when it is whole and on the disk: it is
/// written under an unpredictable temporary name, in the same folder, and renamed by
/// commit(). Without commit() the destructor removes the temporary, so an interrupted run leaves
/// no half file and never costs the file that was there before. What a killed run left of the same
/// output is removed by the next one, unless somebody is writing it. A file that is replaced keeps
/// its mode, and a symbolic link to it stays one. A device, FIFO or socket, such as /dev/null or
/// /dev/stdout, is never replaced: commit() copies the bytes into it.
class OutputFile {
 public:
  /// @throws FileError when the folder does not exist or cannot be written
  explicit OutputFile(std::string path);
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;

  /// The path that commit() gives the file.
  const std::string& path() const { return path_; }
  /// An empty file, to be opened and written by this name; never a link or a device.
  const std::string& temporary_path() const { return temporary_path_; }

  /// Puts the bytes on the disk, so that commit() has little left that can fail. All streams to the
  /// temporary must have been closed or flushed. @throws FileError
  void sync() const;
  /// Gives the file its final name, once its bytes are on the disk. All streams to the temporary
  /// must have been closed or flushed. @throws FileError
  void commit();

 private:
  std::string path_;            ///< as the caller calls it
  std::string target_;          ///< what is replaced, behind symbolic links
  std::string temporary_path_;  ///< empty when there is nothing to remove
  int temporary_ = -1;          ///< keeps hold of the file that was created, whatever its name
  bool copied_ = false;         ///< the target is no regular file
};

}  // namespace risley::io
