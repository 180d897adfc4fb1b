// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "risley/core/instruction_set.hpp"

namespace risley::recordings {

/// Points being written to columns, which have room for them from their first entry on.
struct CartesianArguments {
  std::size_t points = 0;
  double step = 0;                                                 ///< of the coordinates, m
  const double *x = nullptr, *y = nullptr, *z = nullptr;           ///< [points], m
  double *azimuth = nullptr, *zenith = nullptr, *range = nullptr;  ///< [points]
  float *azimuth_resolution = nullptr, *zenith_resolution = nullptr, *range_resolution = nullptr;
  std::uint8_t* valid = nullptr;
};

/// As set_cartesian() of each point, to 4e-16 in angles: all instruction sets give the same bits.
RISLEY_DECLARE_KERNEL(void set_cartesian_points(const CartesianArguments& arguments))

}  // namespace risley::recordings
