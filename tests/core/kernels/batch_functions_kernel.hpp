// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/core/instruction_set.hpp"

namespace risley::batch_functions_test {

/// A multiple of the lanes of every instruction set.
inline constexpr std::size_t kMostLanes = 8;

RISLEY_DECLARE_KERNEL(void sines(const double* angle, std::size_t count, double* sine,
                                 double* cosine))
RISLEY_DECLARE_KERNEL(void angles(const double* x, const double* y, const double* z,
                                  std::size_t count, double* azimuth, double* zenith))

}  // namespace risley::batch_functions_test
