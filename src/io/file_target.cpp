// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "io/file_target.hpp"

#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "risley/core/error.hpp"

namespace risley::io {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLinks = 40;  // as the kernel follows
constexpr mode_t kModeBits = 0777;

/// The names of open files of this or of another process, /dev/stdout among them.
bool is_name_of_open_file(const fs::path& link) {
  const fs::path folder = fs::canonical(fs::absolute(link).parent_path());
  const auto top = std::next(folder.begin());  // behind "/"
  return folder == "/dev" || (top != folder.end() && *top == "proc");
}

/// Syncs a folder's entries to disk. @return 0 or the error
int sync_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return errno == EACCES ? 0 : errno;  // may be written but not read
  const int error = ::fsync(descriptor) != 0 ? errno : 0;
  ::close(descriptor);
  return error == EINVAL || error == ENOTSUP ? 0 : error;  // file systems without
}

}  // namespace

void refuse(const std::string& path, int error) {
  throw FileError(path, {}, fmt::format("cannot be written: {}", std::strerror(error)));
}

bool is_named(int file, const std::string& path) {
  struct stat opened {
  }, named{};
  return ::fstat(file, &opened) == 0 && ::lstat(path.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

FileTarget find_target(const std::string& path) {
  FileTarget result;
  if (path.empty()) refuse(path, ENOENT);
  fs::path target = path;
  for (int links = 0; fs::is_symlink(target); ++links) {
    if (is_name_of_open_file(target)) {
      result.copied = true;
      break;
    }
    if (links == kMostLinks) refuse(path, ELOOP);
    target = target.parent_path() / fs::read_symlink(target);
  }
  const fs::file_status status = fs::status(target);
  if (fs::is_directory(status)) {
    throw FileError(path, {}, "is a folder, expected a file name");
  }
  result.copied = result.copied || (fs::exists(status) && !fs::is_regular_file(status));
  result.path = target.string();
  if (result.copied) {
    if (::access(result.path.c_str(), W_OK) != 0) refuse(path, errno);
    result.mode = S_IRUSR | S_IWUSR;
  } else if (struct stat before{}; ::stat(result.path.c_str(), &before) == 0) {
    result.mode = (before.st_mode & kModeBits) | S_IRUSR | S_IWUSR;
  }
  return result;
}

void sync_output(const FileTarget& target, const std::string& path, int temporary,
                 const std::string& temporary_path) {
  if (!is_named(temporary, temporary_path)) {
    throw FileError(
        path, {},
        fmt::format("cannot be written: {} was replaced in the meantime", temporary_path));
  }
  struct stat before {};
  if (!target.copied && ::stat(target.path.c_str(), &before) == 0 &&
      ::fchmod(temporary, before.st_mode & kModeBits) != 0) {
    refuse(path, errno);
  }
  if (whole([&] { return ::fsync(temporary); }) != 0) refuse(path, errno);
}

void replace_target(const FileTarget& target, const std::string& path,
                    std::string& temporary_path) {
  if (::rename(temporary_path.c_str(), target.path.c_str()) != 0) refuse(path, errno);
  temporary_path.clear();
  const fs::path folder = fs::path(target.path).parent_path();
  if (const int error = sync_folder(folder.empty() ? "." : folder)) refuse(path, error);
}

}  // namespace risley::io
