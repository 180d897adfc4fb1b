// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "risley/core/progress.hpp"

/// Work on several threads. These functions can be nested, and none returns before all its work is
/// done: if one part throws, the others are cancelled, and parallel work within them throws
/// Cancelled instead of returning half a result.
namespace risley::parallel {

/// Number of threads that may work for the caller, including its own.
std::size_t thread_count();

/// Calls body(i) for every i below count, on several threads.
/// @throws exceptions of a body, one of them if several throw; Cancelled if this is part of other
/// work that ended that way
void for_each(std::size_t count, const std::function<void(std::size_t)>& body);

/// The same for jobs that are parallel themselves: a thread that waits within one never begins
/// another.
/// @param progress  receives the share that is done; checked for cancellation before each job
/// @throws Cancelled, and as for_each()
void for_each_job(std::size_t count, const std::function<void(std::size_t)>& job,
                  const Progress& progress = {});

/// Background work.
class TaskGroup {
 public:
  TaskGroup();
  ~TaskGroup();  ///< tasks that have not begun never do; waits for those that have
  TaskGroup(const TaskGroup&) = delete;
  TaskGroup& operator=(const TaskGroup&) = delete;

  void run(std::function<void()> task);  ///< may begin at once, later or in wait()
  /// Until all is done. More may run afterwards.
  /// @throws exceptions of a task, one of them if several throw; Cancelled if this is part of other
  /// work that ended that way
  void wait();

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

/// A pipeline's operation on each item.
struct Stage {
  /// Several items at a time, or one after the other.
  enum class Order { as_they_come, in_turn };
  Order order;
  std::function<void(std::size_t slot)> work;
};

/// A pipeline of items: fill(slot) puts the next one into a free slot, from one thread at a time,
/// until it returns false; then every stage processes it. Items leave the last stage, which must be
/// sequential, in the order in which they came, so sums formed there do not depend on the number of
/// threads. Slots are used in turn, [0, slots).
/// @throws exceptions of any of them, one of them if several throw; Cancelled if this is part of
/// other work that ended that way
void run_pipeline(std::size_t slots, const std::function<bool(std::size_t)>& fill,
                  const std::vector<Stage>& stages);

/// A separate number of threads that do the work instead of the caller's threads.
class Threads {
 public:
  /// @param count  1 or more; 0 for those of the caller
  explicit Threads(int count);
  ~Threads();
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

  void run(const std::function<void()>& work);  ///< @throws what the work throws

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace risley::parallel
