// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <shared_mutex>

namespace risley::io {

/// Who forks holds it alone; threads within OpenSSL share it. A child has only the thread that
/// forked, and would wait forever for locks that another one held: NetCDF's library uses OpenSSL.
/// For the same reason a child never takes this one.
inline std::shared_mutex& fork_lock() {
  static std::shared_mutex lock;
  return lock;
}

}  // namespace risley::io
