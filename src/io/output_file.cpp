// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/output_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include "risley/core/error.hpp"
#include "risley/io/temporaries.hpp"

#include "io/file_target.hpp"

namespace risley::io {
namespace {

namespace fs = std::filesystem;

constexpr int kMostTries = 100;  // of names that all exist already
constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz234567";

/// 12 random characters of 32.
std::string random_name() {
  std::array<unsigned char, 12> bytes{};
  if (whole([&] { return ::getrandom(bytes.data(), bytes.size(), 0); }) !=
      static_cast<ssize_t>(bytes.size())) {
    throw std::system_error(errno, std::generic_category(), "getrandom");
  }
  std::string name;
  for (const unsigned char byte : bytes) name += kLetters[byte % kLetters.size()];
  return name;
}

constexpr std::string_view kMark = ".part-";
constexpr std::size_t kMarkBytes = 18;  // with the random name
constexpr std::size_t kLongestName = 255;

/// The common prefix of all temporaries of a file.
std::string marked(const std::string& name) {
  return name.substr(0, kLongestName - kMarkBytes).append(kMark);
}

/// File systems on which a lock applies to the whole file, so that the temporary's own writers
/// would wait.
bool locks_are_shared(int file) {
  constexpr std::array<unsigned, 3> kNetworkTypes = {0x6969, 0xff534d42, 0xfe534d42};  // NFS, SMB
  struct statfs system {};
  return ::fstatfs(file, &system) != 0 ||
         std::find(kNetworkTypes.begin(), kNetworkTypes.end(),
                   static_cast<unsigned>(system.f_type)) != kNetworkTypes.end();
}

/// Marks an open file as being written. The kernel releases the lock however its owner ends;
/// process ids, which containers share, are not used.
/// @return whether this is its only owner; false without such locks
bool lock(int file) {
  if (locks_are_shared(file)) return false;
  struct flock whole_file {};
  whole_file.l_type = F_WRLCK;
  whole_file.l_whence = SEEK_SET;
  return ::fcntl(file, F_OFD_SETLK, &whole_file) == 0;
}

/// Removes a temporary whose owner was killed.
void remove_orphan(const std::string& path) {
  const int file =
      whole([&] { return ::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC); });
  if (file < 0) return;
  struct stat status {};
  const bool ours = ::fstat(file, &status) == 0 && S_ISREG(status.st_mode) &&
                    status.st_uid == ::geteuid() && status.st_nlink == 1;
  // An owner about to lock it finds the name gone and takes another.
  if (ours && lock(file) && is_named(file, path)) ::unlink(path.c_str());
  ::close(file);
}

/// Removes the temporaries of runs that were killed while writing this output. A process lists a
/// folder only once: temporaries created later belong to running processes.
void remove_orphans(const fs::path& output) {
  static std::mutex mutex;
  static std::map<std::string, std::vector<std::string>> temporaries;  // by their folder
  const std::string folder = output.has_parent_path() ? output.parent_path().string() : ".";
  const std::scoped_lock guard(mutex);
  const auto [found, is_new] = temporaries.try_emplace(folder);
  if (is_new) {
    std::error_code code;
    for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code)) {
      const std::string name = at->path().filename().string();
      if (name.size() <= kMarkBytes) continue;
      const std::string_view ending = std::string_view(name).substr(name.size() - kMarkBytes);
      if (ending.starts_with(kMark) &&
          ending.find_first_not_of(kLetters, kMark.size()) == std::string_view::npos) {
        found->second.push_back(name);
      }
    }
  }
  const std::string beginning = marked(output.filename().string());
  std::erase_if(found->second, [&](const std::string& name) {
    const bool of_this =
        name.size() == beginning.size() + kMarkBytes - kMark.size() && name.starts_with(beginning);
    if (of_this) remove_orphan((fs::path(folder) / name).string());
    return of_this;
  });
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

}  // namespace

OutputFile::OutputFile(std::string path) : path_(std::move(path)) {
  if (path_.empty()) refuse(path_, ENOENT);
  try {
    const FileTarget target = find_target(path_);
    copied_ = target.copied;
    target_ = target.path;
    const mode_t mode = target.mode;
    const fs::path beside = copied_ ? fs::temp_directory_path() / "risley" : fs::path(target_);
    remove_orphans(beside);
    const std::string beginning =
        (beside.parent_path() / marked(beside.filename().string())).string();
    for (int tries = 0; temporary_ < 0; ++tries) {
      if (tries == kMostTries) refuse(path_, EEXIST);
      temporary_path_ = beginning + random_name();
      note_temporary(temporary_path_);
      temporary_ = whole([&] {
        return ::open(temporary_path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC,
                      mode);
      });
      const int error = errno;
      if (temporary_ < 0) forget_temporary(temporary_path_);
      if (temporary_ < 0 && error != EEXIST) refuse(path_, error);
      if (temporary_ < 0) continue;
      lock(temporary_);
      if (is_named(temporary_, temporary_path_)) continue;  // it was not taken for an orphan
      forget_temporary(temporary_path_);
      ::close(temporary_);
      temporary_ = -1;
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
  if (temporary_path_.empty()) return;
  ::unlink(temporary_path_.c_str());
  forget_temporary(temporary_path_);
}

void OutputFile::move_to(std::string path) {
  try {
    const FileTarget target = find_target(path);
    target_ = target.path;
    copied_ = target.copied;
    path_ = std::move(path);
  } catch (const std::system_error& error) {
    throw FileError(path, {}, fmt::format("cannot be written: {}", error.code().message()));
  }
}

void OutputFile::sync() const {
  sync_output({target_, copied_}, path_, temporary_, temporary_path_);
}

void OutputFile::commit() {
  sync();
  if (copied_) {
    const int target =
        whole([&] { return ::open(target_.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC | O_NOCTTY); });
    if (target < 0) refuse(path_, errno);
    const int copied = copy_bytes(temporary_, target);
    if (::close(target) != 0 || copied != 0) refuse(path_, copied != 0 ? copied : errno);
    ::unlink(temporary_path_.c_str());
    forget_temporary(std::exchange(temporary_path_, {}));
    return;
  }
  const std::string temporary = temporary_path_;
  replace_target({target_, copied_}, path_, temporary_path_);
  forget_temporary(temporary);
}

}  // namespace risley::io
