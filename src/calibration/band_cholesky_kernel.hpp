// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/core/instruction_set.hpp"

namespace risley::calibration {

/// Plain arguments of one call, see optics/batch_kernel.hpp for why they are plain.
struct BandArguments {
  double* rows = nullptr;  ///< [size][width + 1]: entry (i, j) of the band at (i, j - i + width)
  std::size_t size = 0, width = 0;
  double* columns = nullptr;  ///< [size][count], for solve_lower_band
  std::size_t count = 0;
};

/// Replaces a band matrix by its Cholesky factor. @return whether it has one
RISLEY_DECLARE_KERNEL(bool factorise_band(const BandArguments& arguments))

/// Replaces columns by L^-1 columns. @return true
RISLEY_DECLARE_KERNEL(bool solve_lower_band(const BandArguments& arguments))

}  // namespace risley::calibration
