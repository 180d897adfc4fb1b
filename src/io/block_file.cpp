// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/block_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"

namespace risley::io {
namespace {

/// Bytes written to the disk at once.
constexpr std::uint64_t kDiskBytes = std::uint64_t{1} << 22;

}  // namespace

FileDescriptor::~FileDescriptor() { close(); }

int FileDescriptor::close() {
  if (value_ < 0) return 0;
  const int result = ::close(value_);
  value_ = -1;
  return result == 0 ? 0 : errno;
}

InputFile::InputFile(std::string path, std::string_view expected) : path_(std::move(path)) {
  // A pipe would block open() without O_NONBLOCK, which regular files ignore.
  const int descriptor = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  const int problem = errno;
  file_ = std::make_shared<const FileDescriptor>(descriptor);
  struct stat status {};
  const bool found =
      descriptor < 0 ? ::stat(path_.c_str(), &status) == 0 : ::fstat(descriptor, &status) == 0;
  if (!found && problem == ENOENT) throw FileError(path_, {}, "no such file");
  if (found && !S_ISREG(status.st_mode)) {
    throw FileError(
        path_, {},
        fmt::format("is {}, expected {}",
                    S_ISDIR(status.st_mode) ? "a folder" : "not a regular file", expected));
  }
  if (descriptor < 0 || !found) {
    throw FileError(path_, {}, fmt::format("cannot be read: {}", std::strerror(problem)));
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

std::string InputFile::name_for_libraries() const {
  std::string name = fmt::format("/proc/{}/fd/{}", ::getpid(), file_->get());
  return ::access(name.c_str(), R_OK) == 0 ? name : path_;
}

std::size_t InputFile::read(std::uint64_t offset, void* bytes, std::size_t most) const {
  std::size_t done = 0;
  while (done < most) {
    const ssize_t got = ::pread(file_->get(), static_cast<char*>(bytes) + done, most - done,
                                static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      throw FileError(path_, {offset + done, {}},
                      fmt::format("cannot be read: {}", std::strerror(errno)));
    }
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

BlockInput::BlockInput(InputFile file)
    : file_(std::move(file)), block_(std::min<std::uint64_t>(kBlockBytes, file_.size())) {}

const std::uint8_t* BlockInput::at(std::uint64_t offset, std::size_t count) {
  const bool held = offset >= block_offset_ && offset - block_offset_ <= block_bytes_ &&
                    count <= block_bytes_ - (offset - block_offset_);
  if (!held) {
    if (count > block_.size() || offset > size() - count) {
      throw InvalidArgument(fmt::format("bytes = [{}, {}), allowed at most {} within [0, {})",
                                        offset, offset + count, block_.size(), size()));
    }
    block_offset_ = offset;
    block_bytes_ = 0;
    block_bytes_ = file_.read(offset, block_.data(), block_.size());
    if (block_bytes_ < count) {
      throw FileError(path(), {offset + block_bytes_, {}},
                      "the file became shorter while it was read");
    }
  }
  return block_.data() + (offset - block_offset_);
}

BlockOutput::BlockOutput(std::string path)
    : output_(std::move(path)),
      file_(::open(output_.temporary_path().c_str(), O_WRONLY | O_CLOEXEC)) {
  if (file_.get() < 0) {
    throw FileError(output_.path(), {}, fmt::format("cannot be written: {}", std::strerror(errno)));
  }
  block_.reserve(BlockInput::kBlockBytes);
}

std::uint8_t* BlockOutput::append(std::size_t count) {
  if (block_.size() + count > block_.capacity()) flush();
  block_.resize(block_.size() + count);
  return block_.data() + (block_.size() - count);
}

void BlockOutput::patch_u64(std::uint64_t offset, std::uint64_t value) {
  if (size() < 8 || offset > size() - 8) {
    throw InvalidArgument(
        fmt::format("offset = {} of 8 bytes, allowed within the {} written", offset, size()));
  }
  // A number may extend across the border of the bytes already written.
  std::uint8_t bytes[8];
  store<std::uint64_t>(bytes, value);
  if (offset >= written_) {
    std::copy_n(bytes, 8, block_.data() + (offset - written_));
    return;
  }
  if (offset + 8 > written_) flush();
  write_at(bytes, 8, offset);
}

void BlockOutput::flush() {
  write_at(block_.data(), block_.size(), written_);
  // The disk begins immediately, so that commit() hardly waits: for a LAS file of 270 MB 0.1 s.
  // Only a hint: commit() detects a failure.
  const std::uint64_t begin = written_ / kDiskBytes * kDiskBytes;
  const std::uint64_t end = (written_ + block_.size()) / kDiskBytes * kDiskBytes;
  if (end > begin) {
    ::sync_file_range(file_.get(), static_cast<off_t>(begin), static_cast<off_t>(end - begin),
                      SYNC_FILE_RANGE_WRITE);
  }
  written_ += block_.size();
  block_.clear();
}

void BlockOutput::write_at(const std::uint8_t* bytes, std::size_t count, std::uint64_t offset) {
  while (count > 0) {
    const ssize_t done = ::pwrite(file_.get(), bytes, count, static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) {
      throw FileError(output_.path(), {offset, {}},
                      fmt::format("cannot be written: {}", std::strerror(errno)));
    }
    bytes += done;
    count -= static_cast<std::size_t>(done);
    offset += static_cast<std::uint64_t>(done);
  }
}

void BlockOutput::commit() {
  flush();
  if (const int error = file_.close(); error != 0) {
    throw FileError(output_.path(), {}, fmt::format("cannot be written: {}", std::strerror(error)));
  }
  output_.commit();
}

}  // namespace risley::io
