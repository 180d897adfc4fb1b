// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "risley/io/output_file.hpp"

namespace risley::io {

/// An open file descriptor, closed with its owner.
class FileDescriptor {
 public:
  explicit FileDescriptor(int value) : value_(value) {}
  ~FileDescriptor();
  FileDescriptor(FileDescriptor&& other) noexcept : value_(other.value_) { other.value_ = -1; }
  FileDescriptor& operator=(FileDescriptor&&) = delete;
  int get() const { return value_; }                   ///< the descriptor, still owned by this
  int release() { return std::exchange(value_, -1); }  ///< the caller's from now on

  /// @return 0, or errno when the system refuses (a full disk may show only here)
  int close();

 private:
  int value_;
};

/// A binary file read through one block of memory; going forward costs one copy per byte.
class BlockInput {
 public:
  /// @throws FileError when the file is missing or not a regular file
  explicit BlockInput(std::string path);

  const std::string& path() const { return path_; }  ///< as it was given
  std::uint64_t size() const { return size_; }       ///< bytes, when it was opened

  /// The bytes [offset, offset + count), until the next call; they must lie inside the file.
  /// @param count  at most kBlockBytes
  /// @throws FileError when the disk fails, InvalidArgument for other bytes
  const std::uint8_t* at(std::uint64_t offset, std::size_t count);

  /// Most bytes that at() gives at once.
  static constexpr std::size_t kBlockBytes = std::size_t{1} << 18;

 private:
  std::string path_;
  FileDescriptor file_;
  std::uint64_t size_ = 0;
  std::vector<std::uint8_t> block_;
  std::uint64_t block_offset_ = 0;
  std::size_t block_bytes_ = 0;
};

/// A binary file written in blocks, with the possibility to fill in a number later. It appears
/// under its name only with commit().
class BlockOutput {
 public:
  /// @throws FileError
  explicit BlockOutput(std::string path);

  const std::string& path() const { return output_.path(); }       ///< that commit() will give it
  std::uint64_t size() const { return written_ + block_.size(); }  ///< bytes appended so far

  /// Room for count more bytes at the end, until the next call. @throws FileError
  std::uint8_t* append(std::size_t count);

  /// Overwrites eight bytes written before by a little-endian number. @throws FileError,
  /// InvalidArgument where they were not
  void patch_u64(std::uint64_t offset, std::uint64_t value);

  /// @throws FileError
  void commit();

 private:
  void flush();
  void write_at(const std::uint8_t* bytes, std::size_t count, std::uint64_t offset);

  OutputFile output_;
  FileDescriptor file_;
  std::vector<std::uint8_t> block_;
  std::uint64_t written_ = 0;
};

}  // namespace risley::io
