// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Packets of the second generation for tests, written byte by byte.
#pragma once

#include <cstdint>
#include <cstring>
#include <vector>

#include <zlib.h>

namespace risley::recordings::numbered_packets {

inline constexpr std::int64_t kStart = 1'700'000'000'123'456'789;  // ns

/// Time of a Mid-360's packet, ns.
inline std::int64_t time_of(std::size_t packet) {
  return kStart + static_cast<std::int64_t>(packet) * 480'000;
}

/// What a packet is to hold.
struct Sent {
  std::uint16_t number = 0;
  std::int64_t time_ns = kStart;
  std::uint8_t frame = 0;
  std::uint8_t data_type = 1;  // or 0
  std::uint16_t interval = 4750;
  std::uint8_t time_type = 1;
};

/// 96 points, every fourth without return, of which one is outside the field of view; or one
/// inertial sample.
inline std::vector<std::uint8_t> packet(const Sent& sent) {
  const bool is_imu = sent.data_type == 0;
  const std::uint16_t records = is_imu ? 1 : 96;
  std::vector<std::uint8_t> bytes(36 + std::size_t{records} * (is_imu ? 24 : 14));
  const auto put = [&bytes](std::size_t at, auto value) {
    std::memcpy(&bytes[at], &value, sizeof value);
  };
  put(1, static_cast<std::uint16_t>(bytes.size()));
  put(3, is_imu ? std::uint16_t{0} : sent.interval);
  put(5, records);
  put(7, sent.number);
  bytes[9] = sent.frame;
  bytes[10] = sent.data_type;
  bytes[11] = sent.time_type;
  put(28, sent.time_ns);
  for (std::size_t i = 0; i < records; ++i) {
    if (is_imu) {
      for (std::size_t k = 0; k < 6; ++k) {
        put(36 + 4 * k, static_cast<float>(sent.number % 100 + k) / 256.0F);
      }
      break;
    }
    const std::size_t at = 36 + 14 * i;
    if (i % 4 == 3) {
      bytes[at + 12] = i == 7 ? 60 : 0;
      continue;
    }
    const auto number = static_cast<std::int32_t>(i + sent.number % 1000);
    put(at, 2000 + 7 * number);
    put(at + 4, 500 - 3 * number);
    put(at + 8, number % 300 - 100);
    bytes[at + 12] = static_cast<std::uint8_t>(i);
    bytes[at + 13] = i % 10 == 0 ? 0x10 : 0;
  }
  put(24, static_cast<std::uint32_t>(crc32(0, &bytes[28], static_cast<uInt>(bytes.size() - 28))));
  return bytes;
}

}  // namespace risley::recordings::numbered_packets
