// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <concepts>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "risley/core/error.hpp"

namespace risley {

/// A computation was stopped on request and left no trace.
class Cancelled : public Error {
 public:
  Cancelled() : Error("cancelled") {}
};

/// Asks computations to stop; may be set from any thread and from a signal handler.
class CancelFlag {
 public:
  void set() noexcept { set_.store(true, std::memory_order_relaxed); }  ///< cannot be taken back
  /// Whether to stop.
  bool is_set() const noexcept { return set_.load(std::memory_order_relaxed); }

 private:
  static_assert(std::atomic<bool>::is_always_lock_free);
  std::atomic<bool> set_{false};
};

/// Progress reports of a long computation, and its cancellation. It calls from one thread at a
/// time. A callback stops it by throwing, preferably Cancelled; a flag stops it with Cancelled even
/// if there is nothing to report. An empty Progress ignores reports.
class Progress {
 public:
  /// @param fraction  done, [0, 1]  @param stage  of a job that has several; may be empty
  using Callback = std::function<void(double fraction, std::string_view stage)>;

  Progress() = default;
  /// @param cancel  checked if given; must outlive the computation
  template <std::invocable<double, std::string_view> F>
  Progress(F callback, const CancelFlag* cancel = nullptr)  // NOLINT(*-explicit-constructor)
      : callback_(std::move(callback)), cancel_(cancel) {}
  template <std::invocable<double> F>
  Progress(F callback, const CancelFlag* cancel = nullptr)  // NOLINT(*-explicit-constructor)
      : callback_([callback = std::move(callback)](double fraction, std::string_view) {
          callback(fraction);
        }),
        cancel_(cancel) {}

  /// @throws Cancelled, and exceptions of the callback
  void report(double fraction) const {
    check();
    if (callback_) callback_(fraction, stage_);
  }
  /// @throws Cancelled when the flag is set
  void check() const {
    if (cancelled()) throw Cancelled();
  }
  /// The same where exceptions are not allowed.
  bool cancelled() const noexcept { return cancel_ != nullptr && cancel_->is_set(); }

  /// Another callback, the same flag.
  Progress with(Callback callback) const {
    Progress result = *this;
    result.callback_ = std::move(callback);
    return result;
  }
  /// For work of unknown extent: it can be cancelled by the flag and reports nothing.
  Progress silent() const { return with({}); }
  /// For a stage of a job: the same, its fractions from 0 to 1 again.
  Progress stage(std::string name) const {
    Progress result = *this;
    result.stage_ = std::move(name);
    return result;
  }
  /// For a part of the work: its 0 is reported as `from`, its 1 as `to`.
  Progress part(double from, double to) const {
    if (!callback_) return *this;
    return with([callback = callback_, from, to](double fraction, std::string_view stage) {
      callback(from + (to - from) * fraction, stage);
    });
  }

 private:
  Callback callback_;
  const CancelFlag* cancel_ = nullptr;
  std::string stage_;
};

}  // namespace risley
