// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>

#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

namespace risley::estimation {

/// Calls make(i) for i = 0, 1, ... from several threads, and take(result) with what each call
/// returned from one thread at a time, in that order: sums that are taken so do not depend on the
/// number of threads. Few results wait at a time.
template <class Make, class Take>
void in_order(std::size_t count, const Make& make, const Take& take) {
  using Result = std::shared_ptr<decltype(make(std::size_t{}))>;
  std::size_t next = 0;
  const auto choose = [&](tbb::flow_control& control) -> std::size_t {
    if (next == count) control.stop();
    return next++;
  };
  const auto threads = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  tbb::parallel_pipeline(
      2 * threads,
      tbb::make_filter<void, std::size_t>(tbb::filter_mode::serial_in_order, choose) &
          tbb::make_filter<std::size_t, Result>(
              tbb::filter_mode::parallel,
              [&](std::size_t i) {
                return std::make_shared<typename Result::element_type>(make(i));
              }) &
          tbb::make_filter<Result, void>(tbb::filter_mode::serial_in_order,
                                         [&](const Result& result) { take(*result); }));
}

}  // namespace risley::estimation
