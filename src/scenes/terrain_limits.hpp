// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

/// Limits of terrain, in files and in code.
namespace risley::scenes {

/// In extended precision, as files are read: 0.1 is allowed where a file may hold 0.1 and more.
struct Limits {
  long double lowest = 0, highest = 0;
};

inline constexpr Limits kPlaceLimits{-1e5, 1e5};       ///< x and y, m
inline constexpr Limits kHeightLimits{-1e4, 1e4};      ///< of the ground and of the origin, m
inline constexpr Limits kAmplitudeLimits{0.0, 1e3};    ///< m
inline constexpr Limits kWavelengthLimits{0.1L, 1e6};  ///< m
inline constexpr Limits kSizeLimits{0.01L, 1e4};       ///< of objects on the ground, m
inline constexpr Limits kPitchLimits_deg{1.0, 89.0};   ///< of roofs
inline constexpr int kMostSines = 64;                  ///< relief and waves together
inline constexpr int kMostVillageRoofs = 20'000;

}  // namespace risley::scenes
