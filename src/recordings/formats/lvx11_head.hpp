// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "risley/recordings/observations.hpp"

namespace risley::recordings {

/// Bytes of a frame's header.
inline constexpr std::size_t kLvx11FrameHeaderBytes = 24;

/// The part of LVX 1.1 before the first frame: headers and device table.
/// @throws InvalidArgument for more than 255 devices, a duplicate index, and serial numbers that
/// are too long
std::vector<std::uint8_t> lvx11_head(const std::vector<Device>& devices,
                                     std::uint32_t frame_duration_ms);

}  // namespace risley::recordings
