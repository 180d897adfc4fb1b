// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <mutex>

namespace risley::io {

/// To be held around every call of rosbag_storage, its constructors and destructors included: the
/// library sets up its logging and its plugins in variables of the process that nothing guards.
inline std::unique_lock<std::recursive_mutex> lock_rosbag() {
  static std::recursive_mutex mutex;
  return std::unique_lock(mutex);
}

}  // namespace risley::io
