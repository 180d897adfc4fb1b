// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "risley/core/saturating.hpp"

namespace risley::cloud {

/// Overlap of the pieces of a recording, because rotation angles are less certain at the end of
/// one.
inline constexpr std::int64_t kOverlapNs = 100'000'000;
/// The most rows that any sensor gives in that time: three returns of 240 kHz (Avia). More are
/// those of a clock that stands still.
inline constexpr std::size_t kMostOverlapRows = 72'000;

/// First row of those in front of `end` that belong to the last kOverlapNs of their clock.
/// @param end  at most time_ns.size()
inline std::size_t overlap_begin(std::span<const std::int64_t> time_ns, std::size_t end) {
  std::size_t row = end;
  while (row > 0 && end - row < kMostOverlapRows &&
         time_ns[row - 1] > saturating_difference(time_ns[end - 1], kOverlapNs) &&
         time_ns[row - 1] <= saturating_sum(time_ns[end - 1], kOverlapNs)) {
    --row;
  }
  return row;
}

}  // namespace risley::cloud
