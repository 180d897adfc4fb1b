// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include "risley/core/progress.hpp"

#include "python/bind.hpp"

namespace risley::python {

/// A call that may release the interpreter's lock is registered as long as it runs: before the
/// interpreter ends, it stops the call or waits for it, and then blocks its thread, as well as
/// threads that begin one afterwards. A thread that requests the lock later would be killed in the
/// middle of C++. A call within another is part of it. Made and destroyed with the lock.
class RunningCall {
 public:
  /// @param cancel  stops it, if any
  explicit RunningCall(CancelFlag* cancel = nullptr);
  ~RunningCall();
  RunningCall(const RunningCall&) = delete;
  RunningCall& operator=(const RunningCall&) = delete;

  /// false in the thread that ends the interpreter, which keeps the lock.
  bool may_unlock() const { return may_unlock_; }

 private:
  CancelFlag* cancel_;
  bool may_unlock_ = true;
};

/// Calls a function that does not use Python without the interpreter's lock.
template <class Function>
decltype(auto) unlocked(Function&& function) {
  const RunningCall call;
  std::optional<py::gil_scoped_release> release;
  if (call.may_unlock()) release.emplace();
  return std::forward<Function>(function)();
}

/// Runs a job in a separate thread, while this one checks for signals and reports progress to
/// Python, ten times a second.
/// @param on_progress  callable(stage, fraction), or None; an exception in it stops the job
/// @param threads  that the job may use; 0: all cores
/// @param cancel  stops the job; a new one if there is none
/// @throws exceptions of the job and of `on_progress` and, after Ctrl-C, KeyboardInterrupt
void run_job(const py::object& on_progress, int threads,
             const std::function<void(const Progress&)>& job, CancelFlag* cancel = nullptr);

}  // namespace risley::python
