// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/folder.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "risley/core/error.hpp"
#include "risley/io/temporaries.hpp"

namespace risley::io {

namespace fs = std::filesystem;

namespace {

constexpr const char* kMemory = "/dev/shm";
/// Others need memory, too, and every thread may have such a folder.
constexpr double kPlenty = 50.0;

bool has_room(const char* folder, double bytes) {
  struct statvfs room {};
  return ::statvfs(folder, &room) == 0 && ::access(folder, W_OK) == 0 &&
         static_cast<double>(room.f_bavail) * static_cast<double>(room.f_frsize) > kPlenty * bytes;
}

}  // namespace

bool make_folder(const std::string& path) {
  std::error_code code;
  const bool made = fs::create_directories(path, code);
  if (code || !fs::is_directory(path)) {
    throw FileError(path, {},
                    fmt::format("the folder cannot be created: {}",
                                code ? code.message() : "a file has this name"));
  }
  return made;
}

TemporaryFolder::TemporaryFolder(double bytes) {
  std::error_code code;
  fs::path above = kMemory;
  if (std::getenv("TMPDIR") != nullptr || !has_room(kMemory, bytes)) {
    above = fs::temp_directory_path(code);
  }
  path_ = (above / "risley-XXXXXX").string();
  if (code || ::mkdtemp(path_.data()) == nullptr) {
    throw FileError(code ? "TMPDIR" : above.string(), {},
                    fmt::format("no temporary folder can be created there: {}",
                                code ? code.message() : std::strerror(errno)));
  }
  note_temporary(path_);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  forget_temporary(path_);
}

}  // namespace risley::io
