// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// LZ4 frames and Zstandard, as chunks of MCAP are packed.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

namespace risley::bags {

/// Unpacks chunks, keeping what the libraries need from one to the next.
class Unpacker {
 public:
  Unpacker();
  ~Unpacker();
  Unpacker(const Unpacker&) = delete;
  Unpacker& operator=(const Unpacker&) = delete;

  /// So many bytes at most come of one packed byte: more cannot be claimed.
  /// @param packing  "lz4" or "zstd"; 0 for others, which are not known
  static std::uint64_t most_per_byte(std::string_view packing);

  /// Unpacks one chunk, which must fill its room exactly.
  /// @throws BadMessage when the bytes are not packed so, or hold more or less
  void unpack(std::string_view packing, std::span<const std::uint8_t> packed,
              std::span<std::uint8_t> room);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace risley::bags
