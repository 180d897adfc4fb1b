// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdlib>

namespace risley::testing {

/// How many seeds a Monte Carlo takes: RISLEY_SEEDS in the environment, or the usual number. Bounds
/// that depend on it are written as functions of it.
inline int seeds_or(int usual) {
  const char* wish = std::getenv("RISLEY_SEEDS");
  return wish != nullptr ? std::max(1, std::atoi(wish)) : usual;
}

}  // namespace risley::testing
