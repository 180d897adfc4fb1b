// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include "risley/core/progress.hpp"

#include "python/bind.hpp"

namespace risley::python {

/// A call that may give the interpreter's lock away is noted as long as it runs: the interpreter,
/// before it ends, stops it or waits for it, and stills its thread then, as well as threads that
/// begin one afterwards. A thread that wants the lock later would be killed in the midst of C++. A
/// call within another is part of it. Made and destroyed with the lock.
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

/// Calls a function that touches nothing of Python without the interpreter's lock.
template <class Function>
decltype(auto) unlocked(Function&& function) {
  const RunningCall call;
  std::optional<py::gil_scoped_release> release;
  if (call.may_unlock()) release.emplace();
  return std::forward<Function>(function)();
}

/// Runs a job in a thread of its own, while this one looks for signals and tells Python how far it
/// is, ten times a second.
/// @param tell     callable(stage, fraction), or None; an exception in it stops the job
/// @param threads  that the job may use; 0: all cores
/// @param cancel   stops the job; one of its own where there is none
/// @throws what the job throws, what `tell` raises and, after Ctrl-C, KeyboardInterrupt
void run_job(const py::object& tell, int threads, const std::function<void(const Progress&)>& job,
             CancelFlag* cancel = nullptr);

}  // namespace risley::python
