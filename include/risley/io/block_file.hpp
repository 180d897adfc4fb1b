// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
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

  /// @return 0, or errno on failure (a full disk may show only here)
  int close();

 private:
  int value_;
};

/// A regular file that is opened once and read through any copy of this, at independent places and
/// in any thread.
class InputFile {
 public:
  /// Opens it: a path converts to an input file.
  /// @param expected  for messages: "a recording"
  /// @throws FileError when it is missing or not a regular file
  InputFile(std::string path,  // NOLINT(google-explicit-constructor)
            std::string_view expected = "a file");

  const std::string& path() const { return path_; }  ///< as it was given
  std::uint64_t size() const { return size_; }       ///< bytes, when it was opened
  /// A name under which a library that opens files itself finds this one, also in a child process,
  /// even if its path now leads to another file. Valid as long as this process has the file open.
  std::string name_for_libraries() const;

  /// Reads bytes from an offset on. @return how many; fewer than `most` only at the end
  /// @throws FileError when the disk fails
  std::size_t read(std::uint64_t offset, void* bytes, std::size_t most) const;

 private:
  std::string path_;
  std::shared_ptr<const FileDescriptor> file_;
  std::uint64_t size_ = 0;
};

/// A binary file read through one block of memory; reading forward costs one copy per byte.
class BlockInput {
 public:
  explicit BlockInput(InputFile file);

  const std::string& path() const { return file_.path(); }  ///< as InputFile
  std::uint64_t size() const { return file_.size(); }       ///< as InputFile
  const InputFile& file() const { return file_; }           ///< that is read

  /// The bytes [offset, offset + count), until the next call; they must lie inside the file.
  /// @param count  at most kBlockBytes
  /// @throws FileError for a read error, InvalidArgument for other bytes
  const std::uint8_t* at(std::uint64_t offset, std::size_t count);

  /// Most bytes that at() returns at once.
  static constexpr std::size_t kBlockBytes = std::size_t{1} << 18;

 private:
  InputFile file_;
  std::vector<std::uint8_t> block_;
  std::uint64_t block_offset_ = 0;
  std::size_t block_bytes_ = 0;
};

/// A binary file written in blocks, which allows a number to be filled in later. It appears under
/// its name only at commit().
class BlockOutput {
 public:
  /// @throws FileError
  explicit BlockOutput(std::string path);

  const std::string& path() const { return output_.path(); }       ///< that commit() will give it
  std::uint64_t size() const { return written_ + block_.size(); }  ///< bytes appended so far

  /// Room for count more bytes at the end, until the next call. @throws FileError
  std::uint8_t* append(std::size_t count);

  /// Overwrites eight bytes written earlier by a little-endian number. @throws FileError,
  /// InvalidArgument if they were not
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
