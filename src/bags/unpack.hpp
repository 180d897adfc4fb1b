// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// LZ4 frames and Zstandard, as chunks of MCAP and messages of rosbag2 are packed.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace risley::bags {

/// Unpacks chunks and messages, and reuses the libraries' state.
class Unpacker {
 public:
  Unpacker();
  ~Unpacker();
  Unpacker(const Unpacker&) = delete;
  Unpacker& operator=(const Unpacker&) = delete;

  /// Largest expansion of one packed byte: claims beyond it are false.
  /// @param packing  "lz4" or "zstd"; 0 for unknown ones
  static std::uint64_t most_per_byte(std::string_view packing);

  /// Unpacks one chunk, which must fill its room exactly.
  /// @throws BadMessage when the bytes are not packed this way, or hold more or less
  void unpack(std::string_view packing, std::span<const std::uint8_t> packed,
              std::span<std::uint8_t> room);

  /// A message of ROS 2 as it was before rosbag2 compressed it by Zstandard (compression_mode:
  /// MESSAGE), recognised by first bytes that plain CDR never has; others unchanged.
  /// @return bytes that are valid until the next call
  /// @throws BadMessage as unpack()
  std::span<const std::uint8_t> message(std::span<const std::uint8_t> bytes);

 private:
  std::vector<std::uint8_t> message_;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace risley::bags
