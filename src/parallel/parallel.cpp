// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/parallel/parallel.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

namespace risley::parallel {
namespace {

/// TBB ends the loops within work that failed, and returns from it as if all were done.
void require_done(tbb::task_group_context& context) {
  if (context.is_group_execution_cancelled()) throw Cancelled();
}

}  // namespace

std::size_t thread_count() {
  return static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
}

void for_each(std::size_t count, const std::function<void(std::size_t)>& body) {
  tbb::task_group_context context;
  tbb::parallel_for(
      std::size_t{0}, count, [&](std::size_t i) { body(i); }, context);
  require_done(context);
}

void for_each_job(std::size_t count, const std::function<void(std::size_t)>& job,
                  const Progress& progress) {
  std::mutex mutex;
  std::size_t done = 0;
  tbb::task_group_context context;
  tbb::parallel_for(
      std::size_t{0}, count,
      [&](std::size_t i) {
        progress.check();
        tbb::this_task_arena::isolate([&] { job(i); });
        const std::scoped_lock lock(mutex);
        progress.report(static_cast<double>(++done) / static_cast<double>(count));
      },
      tbb::simple_partitioner(), context);
  require_done(context);
}

struct TaskGroup::Work {
  tbb::task_group group;
};

TaskGroup::TaskGroup() : work_(std::make_unique<Work>()) {}

TaskGroup::~TaskGroup() {
  work_->group.cancel();
  try {
    work_->group.wait();
  } catch (...) {  // its owner left without asking
  }
}

void TaskGroup::run(std::function<void()> task) { work_->group.run(std::move(task)); }

void TaskGroup::wait() {
  if (work_->group.wait() == tbb::canceled) throw Cancelled();
}

void run_pipeline(std::size_t slots, const std::function<bool(std::size_t)>& fill,
                  const std::vector<Stage>& stages) {
  using tbb::filter_mode;
  std::size_t turn = 0;
  const auto choose = [&](tbb::flow_control& control) -> std::size_t {
    const std::size_t slot = turn++ % slots;
    if (!fill(slot)) control.stop();
    return slot;
  };
  const auto mode_of = [](const Stage& stage) {
    return stage.order == Stage::Order::in_turn ? filter_mode::serial_in_order
                                                : filter_mode::parallel;
  };
  tbb::filter<void, std::size_t> chain =
      tbb::make_filter<void, std::size_t>(filter_mode::serial_in_order, choose);
  for (std::size_t i = 0; i + 1 < stages.size(); ++i) {
    const auto work = [&stage = stages[i]](std::size_t slot) {
      stage.work(slot);
      return slot;
    };
    chain = chain & tbb::make_filter<std::size_t, std::size_t>(mode_of(stages[i]), work);
  }
  const auto last = [&stage = stages.back()](std::size_t slot) { stage.work(slot); };
  tbb::task_group_context context;
  tbb::parallel_pipeline(
      slots, chain & tbb::make_filter<std::size_t, void>(mode_of(stages.back()), last), context);
  require_done(context);
}

struct Threads::Work {
  explicit Work(int count) : arena(std::min(count, tbb::info::default_concurrency())) {}
  tbb::task_arena arena;
};

Threads::Threads(int count) : work_(count > 0 ? std::make_unique<Work>(count) : nullptr) {}
Threads::~Threads() = default;

void Threads::run(const std::function<void()>& work) {
  work_ ? work_->arena.execute(work) : work();
}

}  // namespace risley::parallel
