// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "risley/core/progress.hpp"

/// Work on several threads. What is here runs also within each other, and none of it returns before
/// all is done: if one part throws, the others are cancelled, and what runs within them
/// throws Cancelled instead of handing over half a result.
namespace risley::parallel {

/// How many threads may work for the caller, itself among them.
std::size_t thread_count();

/// Calls body(i) for every i below count, on several threads.
/// @throws what a body throws, one of them if several do; Cancelled where this is part of other
///         work that ended so
void for_each(std::size_t count, const std::function<void(std::size_t)>& body);

/// The same for jobs that are parallel themselves: a thread that waits within one never begins
/// another.
/// @param progress  receives the share that is done; checked for cancellation before each job
/// @throws Cancelled, and as for_each()
void for_each_job(std::size_t count, const std::function<void(std::size_t)>& job,
                  const Progress& progress = {});

/// Work that goes on while its owner does something else.
class TaskGroup {
 public:
  TaskGroup();
  ~TaskGroup();  ///< what has not begun never does; waits for what has
  TaskGroup(const TaskGroup&) = delete;
  TaskGroup& operator=(const TaskGroup&) = delete;

  void run(std::function<void()> task);  ///< may begin at once, later or in wait()
  /// Until all is done. More may run afterwards.
  /// @throws what a task throws, one of them if several do; Cancelled where this is part of other
  ///         work that ended so
  void wait();

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

/// What a pipeline does with each item.
struct Stage {
  /// Several items at a time, or one after the other.
  enum class Order { as_they_come, in_turn };
  Order order;
  std::function<void(std::size_t slot)> work;
};

/// A belt of items: fill(slot) puts the next one into a slot that is free, from one thread at a
/// time, until it returns false; then every stage works on it. Items leave the last stage, which
/// must be in turn, in the order in which they came, so sums that are taken there do not depend on
/// the number of threads. Slots are used in turn, [0, slots).
/// @throws what any of them throws, one of them if several do; Cancelled where this is part of
///         other work that ended so
void run_pipeline(std::size_t slots, const std::function<bool(std::size_t)>& fill,
                  const std::vector<Stage>& stages);

/// A number of threads that shall do what else the threads of the caller would.
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
