// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <mutex>

#include <console_bridge/console.h>

namespace risley::bags {

/// Locks rosbag_storage for one thread: needed around every call, constructors and destructors
/// included, because the library keeps its logging and its plugins in unprotected global variables.
/// During its lifetime the library prints nothing: it logs its exceptions.
class RosbagCall {
 public:
  RosbagCall() : handler_(console_bridge::getOutputHandler()) { console_bridge::noOutputHandler(); }
  ~RosbagCall() { console_bridge::useOutputHandler(handler_); }
  RosbagCall(const RosbagCall&) = delete;
  RosbagCall& operator=(const RosbagCall&) = delete;

 private:
  static std::recursive_mutex& mutex() {
    static std::recursive_mutex one;
    return one;
  }

  std::unique_lock<std::recursive_mutex> lock_{mutex()};  // before the handler is asked
  console_bridge::OutputHandler* handler_;
};

}  // namespace risley::bags
