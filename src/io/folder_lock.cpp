// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/folder_lock.hpp"

#include <cerrno>
#include <chrono>
#include <mutex>
#include <set>
#include <thread>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "risley/core/error.hpp"

#include "io/file_target.hpp"

namespace risley::io {
namespace {

/// Folders locked by this process.
struct OwnLocks {
  std::mutex mutex;
  std::set<FileIdentity> folders;
};

OwnLocks& own_locks() {
  static OwnLocks locks;
  return locks;
}

int open_folder(const std::string& folder) {
  return whole([&] { return ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); });
}

/// @return whether another process or descriptor holds it
bool is_refused(int folder, int kind) {
  return whole([&] { return ::flock(folder, kind | LOCK_NB); }) != 0 && errno == EWOULDBLOCK;
}

}  // namespace

FolderLock::FolderLock(const std::string& folder) : folder_(open_folder(folder)) {
  if (folder_ < 0) return;
  // A process that only checks the lock holds it for a moment.
  constexpr int kTries = 20;
  constexpr auto kPause = std::chrono::milliseconds(10);
  for (int tries = 1; is_refused(folder_, LOCK_EX); ++tries) {
    if (tries == kTries) {
      ::close(folder_);
      throw FileError(folder, {},
                      "another run is writing its results there: wait until it has ended, or give "
                      "another folder");
    }
    std::this_thread::sleep_for(kPause);
  }
  identity_ = file_identity(folder);
  const std::scoped_lock guard(own_locks().mutex);
  if (identity_) own_locks().folders.insert(*identity_);
}

FolderLock::~FolderLock() {
  if (folder_ < 0) return;
  {
    const std::scoped_lock guard(own_locks().mutex);
    if (identity_) own_locks().folders.erase(*identity_);
  }
  ::close(folder_);
}

bool is_locked_by_other(const std::string& folder) {
  {
    const std::scoped_lock guard(own_locks().mutex);
    const auto identity = file_identity(folder);
    if (!identity || own_locks().folders.contains(*identity)) return false;
  }
  const int opened = open_folder(folder);
  if (opened < 0) return false;
  const bool locked = is_refused(opened, LOCK_SH);
  ::close(opened);
  return locked;
}

}  // namespace risley::io
