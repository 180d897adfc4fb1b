// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

#include "recordings/formats/livox_messages.hpp"

namespace risley::recordings {

/// Decodes a message as ROS 2 serialises it (plain CDR), and replaces all of `message` but its
/// topic.
/// @throws BadMessage
void decode_ros2_message(MessageKind kind, std::span<const std::uint8_t> bytes,
                         LidarMessage& message);

}  // namespace risley::recordings
