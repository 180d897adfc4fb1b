// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Parallel work ends as a whole: nothing returns before all is done, least of all within other work
// that failed.
#include "risley/parallel/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/parallel/in_order.hpp"
#include "risley/parallel/pool.hpp"

namespace risley::parallel {
namespace {

void wait_a_little() { std::this_thread::sleep_for(std::chrono::microseconds(200)); }

/// What a part of parallel work saw of the work within it.
struct Seen {
  std::atomic<int> whole = 0, stopped = 0, halves = 0;
};

constexpr std::size_t kInner = 32;

/// Calls inner(marks), which shall set all marks or throw, in jobs of which one fails meanwhile.
template <class Inner>
void expect_no_halves(const Inner& inner) {
  Seen seen;
  for (int round = 0; round < 10; ++round) {
    EXPECT_THROW(for_each_job(4,
                              [&](std::size_t job) {
                                if (job == 3) {
                                  wait_a_little();
                                  throw std::runtime_error("this job fails");
                                }
                                for (int i = 0; i < 4; ++i) {
                                  std::vector<std::atomic<int>> marks(kInner);
                                  try {
                                    inner(marks);
                                  } catch (const Cancelled&) {
                                    ++seen.stopped;
                                    throw;
                                  }
                                  const bool all =
                                      std::all_of(marks.begin(), marks.end(),
                                                  [](const auto& m) { return m == 1; });
                                  ++(all ? seen.whole : seen.halves);
                                }
                              }),
                 std::runtime_error);
  }
  EXPECT_EQ(seen.halves, 0);
  EXPECT_GT(seen.whole, 0);
  EXPECT_GT(seen.stopped, 0) << "the failure came when nothing else was under way";
}

using Marks = std::vector<std::atomic<int>>;

TEST(ForEach, CallsEveryIndexOnce) {
  Marks marks(1000);
  for_each(marks.size(), [&](std::size_t i) { ++marks[i]; });
  EXPECT_TRUE(std::all_of(marks.begin(), marks.end(), [](const auto& m) { return m == 1; }));
  for_each(0, [](std::size_t) { FAIL(); });
}

TEST(ForEach, ThrowsWhatABodyThrows) {
  EXPECT_THROW(for_each(100,
                        [](std::size_t i) {
                          if (i == 50) throw InvalidArgument("fifty");
                        }),
               InvalidArgument);
}

TEST(ForEach, NeverHandsOverHalfAResultWhereTheWorkAroundItFailed) {
  expect_no_halves([](Marks& marks) {
    for_each(marks.size(), [&](std::size_t i) {
      wait_a_little();
      ++marks[i];
    });
  });
}

TEST(TaskGroup, NeverHandsOverHalfAResultWhereTheWorkAroundItFailed) {
  expect_no_halves([](Marks& marks) {
    TaskGroup group;
    for (auto& mark : marks) {
      group.run([&mark] {
        wait_a_little();
        ++mark;
      });
    }
    group.wait();
  });
}

TEST(RunPipeline, NeverHandsOverHalfAResultWhereTheWorkAroundItFailed) {
  expect_no_halves([](Marks& marks) {
    in_order(
        marks.size(),
        [](std::size_t i) {
          wait_a_little();
          return i;
        },
        [&](std::size_t i) { ++marks[i]; });
  });
}

TEST(ForEachJob, TellsWhatIsDoneAndCanBeStopped) {
  std::vector<double> reported;
  for_each_job(
      5, [](std::size_t) {}, [&](double fraction) { reported.push_back(fraction); });
  EXPECT_EQ(reported, (std::vector<double>{0.2, 0.4, 0.6, 0.8, 1.0}));
  CancelFlag flag;
  std::atomic<int> begun = 0;
  EXPECT_THROW(for_each_job(
                   1000,
                   [&](std::size_t) {
                     ++begun;
                     flag.set();
                   },
                   Progress([](double) {}, &flag)),
               Cancelled);
  EXPECT_LE(begun, static_cast<int>(thread_count()));
}

TEST(ForEachJob, BeginsNoOtherJobWhileItWaitsWithinOne) {
  thread_local int within = 0;
  std::atomic<int> most = 0;
  for_each_job(50, [&](std::size_t) {
    most = std::max(most.load(), ++within);
    for_each(50, [](std::size_t) { wait_a_little(); });
    --within;
  });
  EXPECT_EQ(most, 1);
}

TEST(TaskGroup, ThrowsWhatATaskThrowsAndGoesOn) {
  TaskGroup group;
  group.run([] { throw EstimationError("no answer"); });
  EXPECT_THROW(group.wait(), EstimationError);
  int done = 0;
  group.run([&] { done = 1; });
  group.wait();
  EXPECT_EQ(done, 1);
}

TEST(TaskGroup, LeftWithoutWaitingHasNothingUnderWay) {
  std::atomic<bool> gone = false, touched = false;
  for (int round = 0; round < 50; ++round) {
    {
      TaskGroup group;
      group.run([&] {
        wait_a_little();
        if (gone) touched = true;
      });
    }
    gone = true;
    std::this_thread::yield();
    gone = false;
  }
  EXPECT_FALSE(touched);
}

TEST(RunPipeline, KeepsItsOrderAndTheNumberOfItsSlots) {
  constexpr std::size_t kSlots = 3, kItems = 200;
  std::vector<std::size_t> slots(kSlots), left;
  std::atomic<int> under_way = 0, most = 0;
  std::size_t next = 0;
  run_pipeline(kSlots,
               [&](std::size_t slot) {
                 if (next == kItems) return false;
                 slots[slot] = next++;
                 most = std::max(most.load(), ++under_way);
                 return true;
               },
               {{Stage::Order::as_they_come,
                 [&](std::size_t slot) {
                   if (slots[slot] % 7 == 0) wait_a_little();
                 }},
                {Stage::Order::in_turn, [&](std::size_t slot) {
                   left.push_back(slots[slot]);
                   --under_way;
                 }}});
  std::vector<std::size_t> wanted(kItems);
  std::iota(wanted.begin(), wanted.end(), std::size_t{0});
  EXPECT_EQ(left, wanted);
  EXPECT_LE(most, static_cast<int>(kSlots));
}

TEST(InOrder, TakesInTurnWhatIsMadeAsItComes) {
  std::vector<std::string> taken;
  in_order(
      50,
      [](std::size_t i) {
        if (i % 5 == 0) wait_a_little();
        return std::to_string(i);
      },
      [&](const std::string& text) { taken.push_back(text); });
  ASSERT_EQ(taken.size(), 50U);
  for (std::size_t i = 0; i < taken.size(); ++i) EXPECT_EQ(taken[i], std::to_string(i));
}

TEST(Threads, AreAsManyAsWanted) {
  std::size_t one = 0, all = 0;
  Threads(1).run([&] { one = thread_count(); });
  EXPECT_EQ(one, 1U);
  Threads(0).run([&] { all = thread_count(); });
  EXPECT_EQ(all, thread_count());
  EXPECT_THROW(Threads(1).run([] { throw InvalidArgument("within"); }), InvalidArgument);
}

TEST(Pool, GivesEachItsOwnAndUsesItAgain) {
  Pool<std::vector<int>> pool;
  std::vector<int>* first = nullptr;
  {
    const auto one = pool.take(), other = pool.take();
    EXPECT_NE(one.get(), other.get());
    one->push_back(7);
    first = one.get();
  }
  const auto again = pool.take(), other = pool.take(), fresh = pool.take();
  EXPECT_TRUE(again.get() == first || other.get() == first);
  EXPECT_NE(fresh.get(), first);
  std::atomic<int> in_use = 0;
  Pool<int> numbers;
  for_each(200, [&](std::size_t) {
    const auto mine = numbers.take();
    *mine = 1 + in_use++;
    const int before = *mine;
    wait_a_little();
    EXPECT_EQ(*mine, before);
  });
}

}  // namespace
}  // namespace risley::parallel
