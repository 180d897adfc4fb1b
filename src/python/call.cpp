// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "python/call.hpp"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "risley/core/require.hpp"
#include "risley/parallel/parallel.hpp"

namespace risley::python {
namespace {

/// All calls of the process that run without the lock.
struct RunningCalls {
  std::mutex mutex;
  std::condition_variable ended;
  std::size_t count = 0;
  std::multiset<CancelFlag*> flags;
  bool interpreter_ends = false;
  std::thread::id ending_thread;
};

/// Threads still running when the interpreter ends use no Python any more: their exceptions would
/// be printed while its streams are being destroyed.
[[noreturn]] void stand_still() {
  PyEval_SaveThread();
  for (;;) std::this_thread::sleep_for(std::chrono::hours(1));  // until the process ends
}

thread_local int depth = 0;  // NOLINT(*-avoid-non-const-global-variables): calls within calls

RunningCalls& running_calls() {
  static auto* calls = new RunningCalls;  // threads may outlive statics
  return *calls;
}

/// Before the interpreter ends: stops all calls that can be stopped and waits for the rest.
void end_calls() {
  constexpr auto kPatience = std::chrono::seconds(30);  // after a fork there is no thread to answer
  RunningCalls& calls = running_calls();
  const py::gil_scoped_release release;
  std::unique_lock lock(calls.mutex);
  calls.interpreter_ends = true;
  calls.ending_thread = std::this_thread::get_id();
  for (CancelFlag* flag : calls.flags) flag->set();
  calls.ended.wait_for(lock, kPatience, [&] { return calls.count == 0; });
}

/// Progress messages of a job, from its thread to the calling one.
class News {
 public:
  struct Item {
    std::string stage;
    double fraction = 0;
  };

  void add(std::string_view stage, double fraction) {
    const std::lock_guard lock(mutex_);
    if (items_.empty() || items_.back().stage != stage) {
      items_.push_back({std::string(stage), fraction});
    } else {
      items_.back().fraction = fraction;
    }
  }

  void end() {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_one();
  }

  /// Waits for the end, with a short response time to Ctrl-C.
  /// @return whether it has come
  bool wait(std::vector<Item>& items) {
    constexpr auto kStep = std::chrono::milliseconds(100);
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kStep, [this] { return ended_; });
    items.clear();
    items.swap(items_);
    return ended_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Item> items_;
  bool ended_ = false;
};

/// Handles signals and messages, with the lock. @throws what Python raises
void attend(const py::object& on_progress, const std::vector<News::Item>& items) {
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  if (on_progress.is_none()) return;
  for (const News::Item& item : items) on_progress(item.stage, item.fraction);
}

}  // namespace

RunningCall::RunningCall(CancelFlag* cancel) : cancel_(cancel) {
  RunningCalls& calls = running_calls();
  std::unique_lock lock(calls.mutex);
  if (calls.interpreter_ends && depth == 0) {
    may_unlock_ = false;
    if (calls.ending_thread != std::this_thread::get_id()) {
      lock.unlock();
      stand_still();
    }
  }
  ++depth;
  ++calls.count;
  if (cancel_ != nullptr) {
    calls.flags.insert(cancel_);
    if (calls.interpreter_ends) cancel_->set();
  }
}

RunningCall::~RunningCall() {
  RunningCalls& calls = running_calls();
  std::unique_lock lock(calls.mutex);
  --depth;
  --calls.count;
  if (cancel_ != nullptr) calls.flags.erase(calls.flags.find(cancel_));
  calls.ended.notify_all();
  if (calls.interpreter_ends && depth == 0 && calls.ending_thread != std::this_thread::get_id()) {
    lock.unlock();
    stand_still();
  }
}

void run_job(const py::object& on_progress, int threads,
             const std::function<void(const Progress&)>& job, CancelFlag* cancel) {
  require_at_least("threads", threads, 0);
  CancelFlag own_flag;
  if (cancel == nullptr) cancel = &own_flag;
  const RunningCall call(cancel);
  if (!call.may_unlock()) throw Cancelled();
  News news;
  std::exception_ptr failure;
  std::thread worker([&] {
    // The first exception of a thread allocates memory, without which the process ends: here there
    // still is some.
    [[maybe_unused]] const volatile int none = std::uncaught_exceptions();
    try {
      const auto run = [&] {
        job({[&news](double fraction, std::string_view stage) { news.add(stage, fraction); },
             cancel});
      };
      // No global limit: lifting one starts threads, and ends the process if there is no memory for
      // them.
      parallel::Threads(threads).run(run);
    } catch (...) {
      failure = std::current_exception();
    }
    news.end();
  });
  std::optional<py::error_already_set> raised;
  std::vector<News::Item> items;
  for (bool ended = false; !ended;) {
    {
      const py::gil_scoped_release release;
      ended = news.wait(items);
      if (ended) worker.join();
    }
    if (raised) continue;
    try {
      attend(on_progress, items);
    } catch (const py::error_already_set& error) {
      raised.emplace(error);
      cancel->set();
    }
  }
  if (raised) throw py::error_already_set(*raised);
  if (failure) std::rethrow_exception(failure);
}

void bind_calls(py::module_&) {
  py::module_::import("atexit").attr("register")(py::cpp_function(end_calls));
}

}  // namespace risley::python
