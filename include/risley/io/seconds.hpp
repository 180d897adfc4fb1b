// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

namespace risley::io {

/// Seconds as whole nanoseconds, rounded to nearest; empty when they do not fit 64 bits.
inline std::optional<std::int64_t> nanoseconds_from_seconds(double seconds) {
  if (!(std::abs(seconds) < 9.2e9)) return std::nullopt;
  const double whole = std::floor(seconds);
  return static_cast<std::int64_t>(whole) * 1'000'000'000 + std::llround((seconds - whole) * 1e9);
}

/// The nearest double; from about 100 days on, where doubles are coarser than 1 ns, the fraction is
/// added last, so that reading the double and writing it again gives the same double.
inline double seconds_from_nanoseconds(std::int64_t time_ns) {
  constexpr std::int64_t kExact = std::int64_t{1} << 53, kSecond = 1'000'000'000;
  if (time_ns > -kExact && time_ns < kExact) return static_cast<double>(time_ns) / 1e9;
  const std::int64_t whole = time_ns / kSecond;
  return static_cast<double>(whole) + static_cast<double>(time_ns - whole * kSecond) / 1e9;
}

}  // namespace risley::io
