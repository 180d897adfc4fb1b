// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace risley {

/// The origin of GPS time, 6 January 1980, s after 1 January 1970.
inline constexpr std::int64_t kGpsEpoch = 315'964'800;
/// Difference of GPS time and the adjusted standard GPS time of LAS files, s.
inline constexpr std::int64_t kGpsAdjustment = 1'000'000'000;
inline constexpr std::int64_t kWeek = 604'800,  ///< s
    kDay = 86'400;                              ///< s

/// GPS time minus UTC, s. None of these sensors is older than July 2012.
/// @param utc_ns  since 1 January 1970
constexpr std::int64_t leap_seconds(std::int64_t utc_ns) {
  constexpr std::int64_t kNanoseconds = 1'000'000'000;
  constexpr std::int64_t k2017 = 1'483'228'800 * kNanoseconds;  // 2017-01-01
  constexpr std::int64_t k2015 = 1'435'708'800 * kNanoseconds;  // 2015-07-01
  constexpr std::int64_t k2012 = 1'341'100'800 * kNanoseconds;  // 2012-07-01
  if (utc_ns >= k2017) return 18;
  if (utc_ns >= k2015) return 17;
  return utc_ns >= k2012 ? 16 : 15;
}

}  // namespace risley
