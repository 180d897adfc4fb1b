// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "risley/parallel/parallel.hpp"

namespace risley::parallel {

/// Calls make(i) for i = 0, 1, ... from several threads, and take(result) with each returned value
/// from one thread at a time, in that order: sums formed this way do not depend on the number of
/// threads. Few results wait at a time.
template <class Make, class Take>
void in_order(std::size_t count, const Make& make, const Take& take) {
  struct Slot {
    std::size_t i = 0;
    std::optional<decltype(make(std::size_t{}))> result;
  };
  std::vector<Slot> slots(2 * thread_count());
  std::size_t next = 0;
  const auto choose = [&](std::size_t slot) {
    if (next == count) return false;
    slots[slot].i = next++;
    return true;
  };
  using Order = Stage::Order;
  run_pipeline(slots.size(), choose,
               {{Order::as_they_come,
                 [&](std::size_t slot) { slots[slot].result.emplace(make(slots[slot].i)); }},
                {Order::in_turn, [&](std::size_t slot) {
                   take(*slots[slot].result);
                   slots[slot].result.reset();
                 }}});
}

}  // namespace risley::parallel
