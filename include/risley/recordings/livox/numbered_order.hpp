// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "risley/recordings/livox/numbered_packet.hpp"
#include "risley/recordings/livox/packet_order.hpp"

namespace risley::recordings::livox {

/// Puts the packets of one sensor of the second generation into their order by their numbers, and
/// counts what is missing exactly. Packets that overtake each other are put right as long as not
/// more than PacketOrder::kWindow came in between.
class NumberedOrder {
 public:
  /// Takes a datagram that the sensor sent. @param host_ns  when it came
  /// @return whether it is a packet
  bool add(std::span<const std::uint8_t> packet, std::int64_t host_ns);
  /// Lets time pass for packets that wait.
  void advance(std::int64_t host_ns);
  /// Nothing more will come: no packet waits.
  void flush();
  /// Packets in their order since the last call.
  std::vector<std::vector<std::uint8_t>> take();

  const PacketCounts& counts() const { return counts_; }  ///< of what take() has given
  /// Packets whose checksum is neither 0 nor that of their bytes; they are kept.
  std::uint64_t wrong_checksums() const { return wrong_checksums_; }

 private:
  struct Held {
    std::vector<std::uint8_t> bytes;
    std::int64_t host_ns = 0;
    std::uint32_t rows = 0;
  };
  /// Points, or inertial samples.
  struct Track {
    PacketNumbers numbers;
    std::map<std::int64_t, Held> held;       // by index
    std::optional<std::int64_t> last_index;  // of those given out
    bool restarted = false;                  // before the next packet that is given out
  };

  void give_out(Track& track);

  std::array<Track, 2> tracks_;
  PacketCounts counts_;
  std::uint64_t wrong_checksums_ = 0;
  std::vector<std::vector<std::uint8_t>> ready_;
  Chunk chunk_;
};

}  // namespace risley::recordings::livox
