// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/packet_file.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/io/little_endian.hpp"

#include "recordings/formats/lvx11_head.hpp"
#include "recordings/formats/lvx_reader.hpp"

namespace risley::recordings::livox {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kFrameDurationMs = 50;

/// Where the bytes go: behind a link, to what it leads to.
std::string target_of(const std::string& path) {
  if (!lower_case(path).ends_with(".lvx")) {
    throw InvalidArgument(
        fmt::format("{}: packets are written as LVX while they come, expected the ending .lvx; "
                    "convert the recording afterwards",
                    path));
  }
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    throw FileError(path, {}, "is no regular file, expected the name of a file");
  }
  return fs::is_symlink(path, code) && fs::exists(status) ? fs::canonical(path).string() : path;
}

int create(const std::string& path, const std::string& unfinished) {
  const int file =
      ::open(unfinished.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (file >= 0) return file;
  if (errno == EEXIST) {
    throw FileError(unfinished, {},
                    "is a recording that was not finished, and can be read; move it away, or "
                    "record under another name");
  }
  throw FileError(path, {}, fmt::format("cannot be written: {}", std::strerror(errno)));
}

}  // namespace

PacketFile::PacketFile(const std::string& path, const std::vector<Device>& devices)
    : path_(target_of(path)),
      unfinished_path_(path_ + ".unfinished"),
      file_(create(path_, unfinished_path_)) {
  try {
    write(lvx11_head(devices, kFrameDurationMs));
  } catch (...) {
    ::unlink(unfinished_path_.c_str());
    throw;
  }
}

PacketFile::~PacketFile() {
  if (!closed_ && frames_ == 0) ::unlink(unfinished_path_.c_str());
}

void PacketFile::write(std::span<const std::uint8_t> bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count = ::pwrite(file_.get(), bytes.data() + done, bytes.size() - done,
                                   static_cast<off_t>(size_ + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const int error = count < 0 ? errno : ENOSPC;
      // A frame that is not whole is none; where even that fails, readers stop at it.
      if (::ftruncate(file_.get(), static_cast<off_t>(size_)) != 0) {
        throw FileError(unfinished_path_, {size_, {}},
                        fmt::format("cannot be written: {}", std::strerror(error)));
      }
      throw FileError(unfinished_path_, {size_, {}},
                      fmt::format("cannot be written: {}; what was recorded before is in it",
                                  std::strerror(error)));
    }
    done += static_cast<std::size_t>(count);
  }
  size_ += bytes.size();
}

void PacketFile::add(std::uint8_t device_index, std::span<const std::uint8_t> packet) {
  if (frame_.empty()) frame_.resize(kLvx11FrameHeaderBytes);
  frame_.push_back(device_index);
  frame_.insert(frame_.end(), packet.begin(), packet.end());
}

void PacketFile::end_frame() {
  if (frame_.empty()) return;
  io::store<std::uint64_t>(frame_.data(), size_);
  io::store<std::uint64_t>(&frame_[kLvxFrameNextAt], size_ + frame_.size());
  io::store<std::uint64_t>(&frame_[kLvxFrameIndexAt], frames_);
  write(frame_);
  frame_.clear();
  ++frames_;
}

void PacketFile::close() {
  end_frame();
  if (::fsync(file_.get()) != 0) {
    throw FileError(unfinished_path_, {},
                    fmt::format("cannot be written: {}", std::strerror(errno)));
  }
  if (::rename(unfinished_path_.c_str(), path_.c_str()) != 0) {
    throw FileError(path_, {},
                    fmt::format("cannot be written: {}; the recording is whole in {}",
                                std::strerror(errno), unfinished_path_));
  }
  closed_ = true;
}

}  // namespace risley::recordings::livox
