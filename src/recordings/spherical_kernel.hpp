// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "risley/core/instruction_set.hpp"

namespace risley::recordings::livox {

/// Spherical records being written to columns, which have room for them from their first entry on.
struct SphericalArguments {
  std::size_t records = 0;
  int returns = 1;      ///< per record, 1 to 3
  bool tagged = false;  ///< always with several returns
  const std::uint8_t* bytes = nullptr;
  double *azimuth = nullptr, *zenith = nullptr, *range = nullptr;  ///< [records * returns]
  float *azimuth_resolution = nullptr, *zenith_resolution = nullptr, *range_resolution = nullptr;
  std::uint8_t *intensity = nullptr, *tag = nullptr, *valid = nullptr;
};

/// @return number of the first record that no sensor can have sent; records if there is none
RISLEY_DECLARE_KERNEL(std::size_t decode_spherical(const SphericalArguments& arguments))

}  // namespace risley::recordings::livox
