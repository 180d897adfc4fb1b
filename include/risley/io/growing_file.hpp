// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "risley/io/block_file.hpp"

namespace risley::io {

struct FileTarget;

/// An output that grows for long and cannot be made again. As OutputFile it gets its name, and
/// replaces a file of that name and keeps its mode, when it is whole; but until then it has a name
/// that everybody can find, and stays whatever happens.
class GrowingFile {
 public:
  /// What its name ends with until commit().
  static constexpr const char* kUnfinished = ".unfinished";

  /// @throws FileError as OutputFile; for what is no regular file; where there is an unfinished
  ///         file of that name, which is never written over
  explicit GrowingFile(const std::string& path);

  const std::string& path() const { return path_; }  ///< that commit() gives the file
  /// Its name until commit(): path(), or what a symbolic link of that name leads to, with
  /// kUnfinished behind. Empty afterwards.
  const std::string& unfinished_path() const { return unfinished_path_; }
  std::uint64_t size() const { return size_; }  ///< bytes written so far

  /// Appends bytes, all or none. @throws FileError when the disk refuses; the file is as before
  void append(std::span<const std::uint8_t> bytes);
  /// Puts the bytes on the disk and gives the file its name. @throws FileError
  void commit();
  /// Removes the file. @throws nothing
  void discard();

 private:
  GrowingFile(const std::string& path, const FileTarget& target);

  std::string path_, target_, unfinished_path_;
  FileDescriptor file_;
  std::uint64_t size_ = 0;
};

}  // namespace risley::io
