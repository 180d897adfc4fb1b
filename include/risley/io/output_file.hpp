// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::io {

/// An output that appears under its final name only when it is complete and on disk: it is written
/// under an unpredictable temporary name, in the same folder, and renamed by commit(). Without
/// commit() the destructor removes the temporary, so an interrupted run leaves no partial file and
/// never destroys the previous file. The next run removes temporaries of the same output left by a
/// killed one, unless a process is still writing them. A replaced file keeps its mode, and a
/// symbolic link to it stays one. A device, FIFO or socket, such as /dev/null or /dev/stdout, is
/// never replaced: commit() copies the bytes into it.
class OutputFile {
 public:
  /// @throws FileError when the folder does not exist or cannot be written
  explicit OutputFile(std::string path);
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;

  /// The path of the file after commit().
  const std::string& path() const { return path_; }
  /// An empty file, to be opened and written by this name; never a link or a device.
  const std::string& temporary_path() const { return temporary_path_; }

  /// Lets commit() give the file another name on the same file system, for example in a folder that
  /// must not exist earlier. @throws FileError
  void move_to(std::string path);

  /// Syncs the bytes to disk, so that little can fail in commit(). All streams to the temporary
  /// must have been closed or flushed. @throws FileError
  void sync() const;
  /// Renames the file to its final name, once its bytes are on disk. All streams to the temporary
  /// must have been closed or flushed. @throws FileError
  void commit();

 private:
  std::string path_;            ///< as the caller calls it
  std::string target_;          ///< the file to be replaced, after resolving symbolic links
  std::string temporary_path_;  ///< empty when there is nothing to remove
  int temporary_ = -1;          ///< keeps the created file open, whatever its name
  bool copied_ = false;         ///< the target is not a regular file
};

}  // namespace risley::io
