// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/output_file.hpp"

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include "risley/core/error.hpp"

namespace risley::io {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLinks = 40;   // as the kernel follows
constexpr int kMostTries = 100;  // of names that all exist already
constexpr mode_t kModeBits = 0777;

[[noreturn]] void refuse(const std::string& path, int error) {
  throw FileError(path, {}, fmt::format("cannot be written: {}", std::strerror(error)));
}

/// Calls again what a signal interrupted.
template <class Call>
auto whole(const Call& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

/// The names of open files of this or of another process, /dev/stdout among them.
bool is_name_of_open_file(const fs::path& link) {
  const fs::path folder = fs::canonical(fs::absolute(link).parent_path());
  const auto top = std::next(folder.begin());  // behind "/"
  return folder == "/dev" || (top != folder.end() && *top == "proc");
}

/// 12 random characters of 32.
std::string random_name() {
  std::array<unsigned char, 12> bytes{};
  if (whole([&] { return ::getrandom(bytes.data(), bytes.size(), 0); }) !=
      static_cast<ssize_t>(bytes.size())) {
    throw std::system_error(errno, std::generic_category(), "getrandom");
  }
  std::string name;
  for (const unsigned char byte : bytes) name += "abcdefghijklmnopqrstuvwxyz234567"[byte % 32];
  return name;
}

/// Writes all the bytes of a file into an open one.
/// @return 0 or the error
int copy_bytes(int from, int to) {
  std::array<char, 1 << 16> buffer;
  for (off_t at = 0;;) {
    const ssize_t length = whole([&] { return ::pread(from, buffer.data(), buffer.size(), at); });
    if (length < 0) return errno;
    if (length == 0) return 0;
    for (ssize_t done = 0; done < length;) {
      const ssize_t count = whole([&] {
        return ::write(to, buffer.data() + done, static_cast<std::size_t>(length - done));
      });
      if (count < 0) return errno;
      done += count;
    }
    at += length;
  }
}

/// Puts a folder's entries on the disk. @return 0 or the error
int sync_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return errno == EACCES ? 0 : errno;  // may be written but not read
  const int error = ::fsync(descriptor) != 0 ? errno : 0;
  ::close(descriptor);
  return error == EINVAL || error == ENOTSUP ? 0 : error;  // file systems without
}

}  // namespace

OutputFile::OutputFile(std::string path) : path_(std::move(path)) {
  if (path_.empty()) refuse(path_, ENOENT);
  fs::path target = path_;
  try {
    for (int links = 0; fs::is_symlink(target); ++links) {
      if (is_name_of_open_file(target)) {
        copied_ = true;
        break;
      }
      if (links == kMostLinks) refuse(path_, ELOOP);
      target = target.parent_path() / fs::read_symlink(target);
    }
    const fs::file_status status = fs::status(target);
    if (fs::is_directory(status)) {
      throw FileError(path_, {}, "is a folder, expected a file name");
    }
    copied_ = copied_ || (fs::exists(status) && !fs::is_regular_file(status));
    target_ = target.string();
    if (copied_ && ::access(target_.c_str(), W_OK) != 0) refuse(path_, errno);
    mode_t mode = copied_ ? S_IRUSR | S_IWUSR : 0666;
    if (struct stat before{}; !copied_ && ::stat(target_.c_str(), &before) == 0) {
      mode = (before.st_mode & kModeBits) | S_IRUSR | S_IWUSR;  // nobody else reads it meanwhile
    }
    const fs::path beside = copied_ ? fs::temp_directory_path() / "risley" : target;
    for (int tries = 0; temporary_ < 0; ++tries) {
      temporary_path_ = fmt::format("{}.part-{}", beside.string(), random_name());
      temporary_ = whole([&] {
        return ::open(temporary_path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC,
                      mode);
      });
      if (temporary_ < 0 && (errno != EEXIST || tries == kMostTries)) refuse(path_, errno);
    }
  } catch (const std::system_error& error) {
    throw FileError(path_, {}, fmt::format("cannot be written: {}", error.code().message()));
  }
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_path_(std::exchange(other.temporary_path_, {})),
      temporary_(std::exchange(other.temporary_, -1)),
      copied_(other.copied_) {}

OutputFile::~OutputFile() {
  if (temporary_ < 0) return;
  ::close(temporary_);
  if (!temporary_path_.empty()) ::unlink(temporary_path_.c_str());
}

void OutputFile::commit() {
  struct stat written {
  }, named{}, before{};
  if (::fstat(temporary_, &written) != 0 || ::lstat(temporary_path_.c_str(), &named) != 0) {
    refuse(path_, errno);
  }
  if (written.st_dev != named.st_dev || written.st_ino != named.st_ino) {
    throw FileError(path_, {},
                    fmt::format("cannot be written: {} was replaced meanwhile", temporary_path_));
  }
  if (copied_) {
    const int target =
        whole([&] { return ::open(target_.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC | O_NOCTTY); });
    if (target < 0) refuse(path_, errno);
    const int copied = copy_bytes(temporary_, target);
    if (::close(target) != 0 || copied != 0) refuse(path_, copied != 0 ? copied : errno);
    ::unlink(temporary_path_.c_str());
    temporary_path_.clear();
    return;
  }
  if (::stat(target_.c_str(), &before) == 0 &&
      ::fchmod(temporary_, before.st_mode & kModeBits) != 0) {
    refuse(path_, errno);
  }
  if (whole([&] { return ::fsync(temporary_); }) != 0) refuse(path_, errno);
  if (::rename(temporary_path_.c_str(), target_.c_str()) != 0) refuse(path_, errno);
  temporary_path_.clear();
  const fs::path folder = fs::path(target_).parent_path();
  if (const int error = sync_folder(folder.empty() ? "." : folder)) refuse(path_, error);
}

}  // namespace risley::io
