// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The command frame of Livox's first generation: UDP traffic between host and sensor in addition to
// the data packets of risley/recordings/livox/packet.hpp. All numbers are little-endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace risley::wire {

/// Bytes of a frame around its data.
inline constexpr std::size_t kFrameOverhead = 15;
/// Longest frame that the protocol allows, bytes.
inline constexpr std::size_t kMostFrameBytes = 1400;

/// Type of a frame for its receiver.
enum class FrameType : std::uint8_t { command = 0, reply = 1, message = 2 };

/// Which command a frame is about.
struct CommandId {
  std::uint8_t set = 0, id = 0;
  friend bool operator==(const CommandId&, const CommandId&) = default;
};

/// A frame without its transport fields.
struct Frame {
  FrameType type = FrameType::command;
  std::uint16_t sequence = 0;  ///< a reply repeats the number of its command
  CommandId command;
  std::span<const std::uint8_t> data;  ///< of the bytes that were decoded, or are to be encoded
};

/// Why bytes are no frame.
enum class FrameFault : std::uint8_t {
  too_short,        ///< fewer bytes than a frame without data
  start,            ///< of another byte than 0xAA
  version,          ///< other than 1
  length,           ///< the frame's length differs from the number of bytes, or is too large
  header_checksum,  ///< CRC-16
  type,             ///< neither command, reply nor message
  checksum,         ///< CRC-32
};

/// What was expected and what was found.
struct FrameRefusal {
  FrameFault fault = FrameFault::too_short;
  std::uint32_t expected = 0, found = 0;
};

/// "frame length = 17, expected 16 bytes"
std::string to_string(const FrameRefusal& refusal);

/// CRC-16 of the header: reflected, polynomial 0x1021, register 0x4C49 at the start.
std::uint16_t frame_crc16(std::span<const std::uint8_t> bytes);
/// CRC-32 of the frame: reflected, polynomial 0x04C11DB7, register 0xA9B0A7F5 at the start,
/// inverted.
std::uint32_t frame_crc32(std::span<const std::uint8_t> bytes);

/// The bytes of a frame. @throws InvalidArgument for more data than a frame can carry
std::vector<std::uint8_t> encode_frame(const Frame& frame);

/// The frame of a whole datagram. Allocates no memory, whatever the bytes are.
/// @return the frame, whose data are a part of the bytes, or the reason why they are not a frame
std::variant<Frame, FrameRefusal> decode_frame(std::span<const std::uint8_t> bytes);

}  // namespace risley::wire
