// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "risley/io/block_file.hpp"

namespace risley::recordings {

/// Bytes read sequentially, from a file or from data packed into one.
class ByteSource {
 public:
  virtual ~ByteSource() = default;

  /// Reads up to count bytes. @return how many; fewer at the end or at damage
  /// @throws FileError when the disk fails
  virtual std::size_t read(std::uint8_t* bytes, std::size_t count) = 0;
  /// Steps over bytes. @return how many there were
  virtual std::uint64_t skip(std::uint64_t count);
  /// Position in the file of the next byte.
  virtual std::uint64_t file_offset() const = 0;
  /// Whether the bytes equal those of the file, one by one.
  virtual bool is_plain() const { return false; }
  /// Reason why there are no more bytes; empty at the normal end.
  const std::string& problem() const { return problem_; }

 protected:
  std::string problem_;
};

/// The bytes [begin, end) of a file, or as many of them as it has.
class FileSource final : public ByteSource {
 public:
  /// @throws FileError
  FileSource(io::InputFile file, std::uint64_t begin, std::uint64_t end);
  std::size_t read(std::uint8_t* bytes, std::size_t count) override;
  std::uint64_t skip(std::uint64_t count) override;
  std::uint64_t file_offset() const override { return offset_; }
  bool is_plain() const override { return true; }

 private:
  io::BlockInput file_;
  std::uint64_t offset_, end_;
};

/// Bytes packed by LZF: runs of literals and copies from the 8 KiB before.
class LzfSource final : public ByteSource {
 public:
  explicit LzfSource(std::unique_ptr<ByteSource> packed) : packed_(std::move(packed)) {}
  std::size_t read(std::uint8_t* bytes, std::size_t count) override;
  std::uint64_t file_offset() const override { return packed_->file_offset() - (end_ - next_); }

 private:
  static constexpr std::size_t kWindow = 8192;
  bool packed_byte(std::uint8_t& byte);
  bool next_run();

  std::unique_ptr<ByteSource> packed_;
  std::array<std::uint8_t, 4096> block_{};
  std::size_t next_ = 0, end_ = 0;
  std::array<std::uint8_t, kWindow> window_{};
  std::uint64_t produced_ = 0;
  std::size_t literals_ = 0, copies_ = 0, distance_ = 0;
};

}  // namespace risley::recordings
