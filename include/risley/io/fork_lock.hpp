// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <mutex>
#include <shared_mutex>

namespace risley::io {

/// A thread that forks holds it exclusively; threads inside OpenSSL share it. A child has only the
/// forking thread and would wait forever for a lock held by another thread: NetCDF's library uses
/// OpenSSL. For the same reason a child never takes this lock.
class ForkLock {
 public:
  /// The one of the process.
  static ForkLock& instance() {
    static ForkLock lock;
    return lock;
  }
  /// Held while OpenSSL is called.
  std::shared_lock<std::shared_mutex> share() {
    const std::scoped_lock in_turn(turn_);
    return std::shared_lock(held_);
  }
  /// Held while the process forks.
  std::unique_lock<std::shared_mutex> alone() {
    const std::scoped_lock in_turn(turn_);
    return std::unique_lock(held_);
  }

 private:
  std::mutex turn_;  ///< keeps shared holders from starving an exclusive one
  std::shared_mutex held_;
};

}  // namespace risley::io
