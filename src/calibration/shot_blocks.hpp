// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>

#include "risley/parallel/parallel.hpp"

namespace risley::calibration {

/// Shots of one task: some milliseconds. Results computed shot by shot do not depend on it.
inline constexpr std::size_t kBlockShots = 65536;

inline std::size_t block_count(std::size_t shots) {
  return (shots + kBlockShots - 1) / kBlockShots;
}

/// Calls function(begin, end) for blocks of shots, in parallel.
template <class Function>
void for_each_block(std::size_t shots, const Function& function) {
  parallel::for_each(block_count(shots), [&](std::size_t block) {
    const std::size_t begin = block * kBlockShots;
    function(begin, std::min(begin + kBlockShots, shots));
  });
}

}  // namespace risley::calibration
