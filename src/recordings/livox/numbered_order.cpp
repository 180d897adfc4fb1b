// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/numbered_order.hpp"

#include <utility>

namespace risley::recordings::livox {
namespace {

constexpr std::size_t kChecked = 28;  // bytes in front of what the checksum is of

}  // namespace

bool NumberedOrder::add(std::span<const std::uint8_t> packet, std::int64_t host_ns) {
  chunk_.clear();
  NumberedHeader header;
  try {
    header = decode_numbered_header(packet);
    decode_numbered_packet(packet, kMid360, 0, chunk_);  // which sensor it is changes no check
  } catch (const BadPacket&) {
    ++counts_.rejected;
    return false;
  }
  if (chunk_.packets.empty()) return true;  // no records: nothing that could be lost
  if (header.checksum != 0 && header.checksum != packet_checksum(packet.subspan(kChecked))) {
    ++wrong_checksums_;
  }
  Track& track = tracks_[header.data_type == kNumberedImu ? 1 : 0];
  const PacketNumbers::Place place = track.numbers.add(chunk_.packets.front());
  if (place.kind == PacketNumbers::Kind::restarted) {
    while (!track.held.empty()) give_out(track);
    track.restarted = track.last_index.has_value();
  } else if (place.kind == PacketNumbers::Kind::duplicate) {
    ++counts_.duplicates;
    return true;
  } else if (track.last_index && place.index <= *track.last_index) {
    ++counts_.late;
    return true;
  }
  if (place.kind == PacketNumbers::Kind::late) ++counts_.reordered;
  track.held.emplace(place.index, Held{{packet.begin(), packet.end()},
                                       host_ns,
                                       static_cast<std::uint32_t>(chunk_.observations.size())});
  while (!track.held.empty() &&
         (track.held.size() > PacketOrder::kWindow || track.restarted ||
          (track.last_index && track.held.begin()->first == *track.last_index + 1))) {
    give_out(track);
  }
  return true;
}

/// Gives out the first packet of those that wait, and counts what is missing before it.
void NumberedOrder::give_out(Track& track) {
  const auto first = track.held.begin();
  Held& packet = first->second;
  if (track.restarted) {
    ++counts_.clock_jumps;
  } else if (track.last_index) {
    counts_.lost += static_cast<std::uint64_t>(first->first - *track.last_index - 1);
  }
  track.restarted = false;
  track.last_index = first->first;
  ++counts_.packets;
  counts_.rows += packet.rows;
  if (packet.rows == 0) ++counts_.imu_samples;
  ready_.push_back(std::move(packet.bytes));
  track.held.erase(first);
}

void NumberedOrder::advance(std::int64_t host_ns) {
  for (Track& track : tracks_) {
    while (!track.held.empty() &&
           host_ns - track.held.begin()->second.host_ns > PacketOrder::kLongestWait) {
      give_out(track);
    }
  }
}

void NumberedOrder::flush() {
  for (Track& track : tracks_) {
    while (!track.held.empty()) give_out(track);
  }
}

std::vector<std::vector<std::uint8_t>> NumberedOrder::take() { return std::exchange(ready_, {}); }

}  // namespace risley::recordings::livox
