// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdlib>

namespace risley::testing {

/// A whole number from 1 on of the environment, or the usual one.
inline int number_or(const char* variable, int usual) {
  const char* wish = std::getenv(variable);
  return wish != nullptr ? std::max(1, std::atoi(wish)) : usual;
}

/// How many seeds a Monte Carlo takes: RISLEY_SEEDS in the environment, or the usual number. Bounds
/// that depend on it are written as functions of it. @param fewest  that the bounds hold for
inline int seeds_or(int usual, int fewest = 1) {
  return std::max(fewest, number_or("RISLEY_SEEDS", usual));
}

}  // namespace risley::testing
