// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "risley/recordings/livox/numbered_packet.hpp"
#include "risley/recordings/livox/packet_order.hpp"

namespace risley::recordings::livox {

/// Packets of the second generation: their numbers show exactly what is missing, whatever the clock
/// does.
class NumberedOrder final : public PacketSequence {
 public:
  bool add(std::span<const std::uint8_t> packet, std::int64_t host_ns) override;
  void advance(std::int64_t host_ns) override;
  void flush() override;

 private:
  struct Held {
    std::vector<std::uint8_t> bytes;
    std::int64_t host_ns = 0, time_ns = 0;
    std::uint32_t rows = 0;
    std::uint8_t time_type = 0;
  };
  /// Points, or inertial samples.
  struct Track {
    PacketNumbers numbers;
    std::map<std::int64_t, Held> held;       // by index
    std::optional<std::int64_t> last_index;  // of those given out
    std::int64_t last_ns = 0, last_host_ns = 0;
    std::int64_t period_ns = 0;  // shortest time between neighbours so far; 0 when unknown
    std::uint8_t last_time_type = 0;
    bool flushed = false;    // before the next packet
    bool paused = false;     // before the next packet returned
    bool restarted = false;  // before the next packet returned
  };

  void give_out(Track& track);
  void compare(Track& track, const Held& packet, std::int64_t index);

  std::array<Track, 2> tracks_;
  Chunk chunk_;
};

/// For packets of a sensor. @param device_type  as recordings::Device::type
/// @param numbered  it is one of the second generation
std::unique_ptr<PacketSequence> packet_sequence(std::uint8_t device_type, bool numbered);

}  // namespace risley::recordings::livox
