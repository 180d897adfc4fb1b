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
/// The most rows of any sensor in that time: three returns of 240 kHz (Avia). More belong to a
/// stopped clock.
inline constexpr std::size_t kMostOverlapRows = 72'000;

/// First row of those before `end` that belong to the last times of their clock.
/// @param end      at most time_ns.size()
/// @param overlap  a multiple of kOverlapNs
inline std::size_t overlap_begin(std::span<const std::int64_t> time_ns, std::size_t end,
                                 std::int64_t overlap = kOverlapNs) {
  const std::size_t most = kMostOverlapRows * static_cast<std::size_t>(overlap / kOverlapNs);
  std::size_t row = end;
  while (row > 0 && end - row < most &&
         time_ns[row - 1] > saturating_difference(time_ns[end - 1], overlap) &&
         time_ns[row - 1] <= saturating_sum(time_ns[end - 1], overlap)) {
    --row;
  }
  return row;
}

}  // namespace risley::cloud
