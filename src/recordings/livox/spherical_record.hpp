// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

// Spherical records, shared by decoder and encoder.
namespace risley::recordings::livox {

inline constexpr int kHalfTurn = 18'000, kFullTurn = 36'000;  // 0.01 deg

/// Positions of the numbers in a record with this many returns. Records of one return begin with
/// the distance, records of several with the angles.
constexpr std::size_t zenith_at(int returns) { return returns == 1 ? 4 : 0; }
constexpr std::size_t depth_at(int returns, int number) {
  return returns == 1 ? 0 : 4 + 6 * static_cast<std::size_t>(number);
}
constexpr std::size_t intensity_at(int returns, int number) {
  return returns == 1 ? 8 : depth_at(returns, number) + 4;
}

}  // namespace risley::recordings::livox
