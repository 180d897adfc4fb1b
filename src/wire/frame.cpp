// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/frame.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"

namespace risley::wire {
namespace {

using io::load;
using io::store;

constexpr std::uint8_t kStart = 0xAA, kFrameVersion = 1;
constexpr std::size_t kLengthAt = 2, kTypeAt = 4, kSequenceAt = 5, kHeaderChecksumAt = 7,
                      kSetAt = 9, kIdAt = 10, kDataAt = 11;
constexpr std::size_t kChecksumBytes = 4;

/// Remainders of all bytes for a reflected polynomial.
template <class Word>
constexpr std::array<Word, 256> remainders(Word polynomial) {
  std::array<Word, 256> table{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    auto rest = static_cast<Word>(byte);
    for (int bit = 0; bit < 8; ++bit) {
      rest = static_cast<Word>((rest & 1U) != 0 ? (rest >> 1U) ^ polynomial : rest >> 1U);
    }
    table[byte] = rest;
  }
  return table;
}

template <class Word>
Word divided(const std::array<Word, 256>& table, Word rest, std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) {
    rest = static_cast<Word>(table[(rest ^ byte) & 0xFFU] ^ (rest >> 8U));
  }
  return rest;
}

}  // namespace

std::string to_string(const FrameRefusal& refusal) {
  switch (refusal.fault) {
    case FrameFault::too_short:
      return fmt::format("{} bytes, expected a frame of at least {}", refusal.found,
                         refusal.expected);
    case FrameFault::start:
      return fmt::format("first byte = 0x{:02X}, expected 0x{:02X}", refusal.found,
                         refusal.expected);
    case FrameFault::version:
      return fmt::format("frame version = {}, expected {}", refusal.found, refusal.expected);
    case FrameFault::length:
      return fmt::format("frame length = {}, expected {} bytes", refusal.found, refusal.expected);
    case FrameFault::header_checksum:
      return fmt::format("CRC-16 = 0x{:04X}, expected 0x{:04X}", refusal.found, refusal.expected);
    case FrameFault::type:
      return fmt::format("frame type = {}, expected 0 to {}", refusal.found, refusal.expected);
    case FrameFault::checksum:
      return fmt::format("CRC-32 = 0x{:08X}, expected 0x{:08X}", refusal.found, refusal.expected);
  }
  return {};
}

std::uint16_t frame_crc16(std::span<const std::uint8_t> bytes) {
  static constexpr auto kTable = remainders<std::uint16_t>(0x8408);
  return divided<std::uint16_t>(kTable, 0x4C49, bytes);
}

std::uint32_t frame_crc32(std::span<const std::uint8_t> bytes) {
  static constexpr auto kTable = remainders<std::uint32_t>(0xEDB88320);
  return ~divided<std::uint32_t>(kTable, 0xA9B0A7F5, bytes);
}

std::vector<std::uint8_t> encode_frame(const Frame& frame) {
  const std::size_t length = kFrameOverhead + frame.data.size();
  if (length > kMostFrameBytes) {
    throw InvalidArgument(fmt::format("a frame with {} bytes of data, allowed at most {}",
                                      frame.data.size(), kMostFrameBytes - kFrameOverhead));
  }
  std::vector<std::uint8_t> bytes(length);
  bytes[0] = kStart;
  bytes[1] = kFrameVersion;
  store<std::uint16_t>(&bytes[kLengthAt], static_cast<std::uint16_t>(length));
  bytes[kTypeAt] = static_cast<std::uint8_t>(frame.type);
  store<std::uint16_t>(&bytes[kSequenceAt], frame.sequence);
  const std::span<const std::uint8_t> whole(bytes);
  store<std::uint16_t>(&bytes[kHeaderChecksumAt], frame_crc16(whole.first(kHeaderChecksumAt)));
  bytes[kSetAt] = frame.command.set;
  bytes[kIdAt] = frame.command.id;
  std::ranges::copy(frame.data, bytes.begin() + kDataAt);
  store<std::uint32_t>(&bytes[length - kChecksumBytes],
                       frame_crc32(whole.first(length - kChecksumBytes)));
  return bytes;
}

std::variant<Frame, FrameRefusal> decode_frame(std::span<const std::uint8_t> bytes) {
  const auto refuse = [](FrameFault fault, std::size_t expected, std::size_t found) {
    return FrameRefusal{fault, static_cast<std::uint32_t>(expected),
                        static_cast<std::uint32_t>(found)};
  };
  if (bytes.size() < kFrameOverhead) {
    return refuse(FrameFault::too_short, kFrameOverhead, bytes.size());
  }
  if (bytes[0] != kStart) return refuse(FrameFault::start, kStart, bytes[0]);
  if (bytes[1] != kFrameVersion) return refuse(FrameFault::version, kFrameVersion, bytes[1]);
  const auto length = load<std::uint16_t>(&bytes[kLengthAt]);
  if (length != bytes.size() || length > kMostFrameBytes) {
    return refuse(FrameFault::length, std::min(bytes.size(), kMostFrameBytes), length);
  }
  const auto header = load<std::uint16_t>(&bytes[kHeaderChecksumAt]);
  if (const auto right = frame_crc16(bytes.first(kHeaderChecksumAt)); header != right) {
    return refuse(FrameFault::header_checksum, right, header);
  }
  constexpr auto kLastType = static_cast<std::uint8_t>(FrameType::message);
  if (bytes[kTypeAt] > kLastType) return refuse(FrameFault::type, kLastType, bytes[kTypeAt]);
  const auto checksum = load<std::uint32_t>(&bytes[length - kChecksumBytes]);
  if (const auto right = frame_crc32(bytes.first(length - kChecksumBytes)); checksum != right) {
    return refuse(FrameFault::checksum, right, checksum);
  }
  return Frame{static_cast<FrameType>(bytes[kTypeAt]),
               load<std::uint16_t>(&bytes[kSequenceAt]),
               {bytes[kSetAt], bytes[kIdAt]},
               bytes.subspan(kDataAt, length - kFrameOverhead)};
}

}  // namespace risley::wire
