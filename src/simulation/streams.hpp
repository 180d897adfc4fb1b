// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

/// Purpose of each stream of random numbers. Numbers keep their meaning, or seeds would change
/// theirs.
namespace risley::simulation::stream {

inline constexpr std::uint64_t kStartAngles = 1;
inline constexpr std::uint64_t kOscillationPhases = 2;
inline constexpr std::uint64_t kAzimuthNoise = 3;
inline constexpr std::uint64_t kZenithNoise = 4;
inline constexpr std::uint64_t kRangeNoise = 5;
inline constexpr std::uint64_t kBushDepth = 6;
constexpr std::uint64_t trajectory_error(std::uint64_t component) { return 20 + component; }
constexpr std::uint64_t trajectory_white_error(std::uint64_t component) { return 30 + component; }
constexpr std::uint64_t random_walk(int prism) { return 100 + static_cast<std::uint64_t>(prism); }

}  // namespace risley::simulation::stream
