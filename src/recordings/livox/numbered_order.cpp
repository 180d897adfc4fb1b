// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/numbered_order.hpp"

#include <cmath>
#include <utility>

#include "risley/core/saturating.hpp"
#include "risley/recordings/livox/packet_encoder.hpp"

namespace risley::recordings::livox {
namespace {

constexpr std::size_t kChecked = 28;  // bytes before those covered by the checksum

}  // namespace

bool NumberedOrder::add(std::span<const std::uint8_t> packet, std::int64_t host_ns) {
  chunk_.clear();
  NumberedHeader header;
  try {
    header = decode_numbered_header(packet);
    decode_numbered_packet(packet, kMid360, 0, chunk_);  // the sensor does not affect the checks
  } catch (const BadPacket&) {
    ++counts_.rejected;
    return false;
  }
  if (!first_host_ns_) first_host_ns_ = host_ns;
  if (chunk_.packets.empty()) return true;  // no records: nothing to lose
  if (header.checksum != 0 && header.checksum != packet_checksum(packet.subspan(kChecked))) {
    ++counts_.wrong_checksums;
  }
  Track& track = tracks_[header.data_type == kNumberedImu ? 1 : 0];
  const PacketNumbers::Place place =
      track.numbers.add(chunk_.packets.front(), std::exchange(track.flushed, false));
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
                                       static_cast<std::int64_t>(header.time_ns),
                                       static_cast<std::uint32_t>(chunk_.observations.size()),
                                       header.time_type});
  while (!track.held.empty() &&
         (track.held.size() > kWindow ||
          (track.last_index && track.held.begin()->first == *track.last_index + 1))) {
    give_out(track);
  }
  return true;
}

/// Counts packets missing before one, and detects a clock that does not fit the numbers.
void NumberedOrder::compare(Track& track, const Held& packet, std::int64_t index) {
  constexpr double kSurelyNotIn = 10'000'000;  // ns, tolerance of times about the period
  constexpr double kLeastSure = 1000;          // of a gap's length
  const std::int64_t steps = index - *track.last_index;
  const std::int64_t passed = saturating_difference(packet.time_ns, track.last_ns);
  PacketGap gap{track.last_ns,   packet.time_ns, track.last_host_ns, packet.host_ns, {},
                packet.rows == 0};
  const bool same_clock = !track.restarted && packet.time_type == track.last_time_type;
  const auto length = static_cast<double>(passed);
  const double off = length - static_cast<double>(steps) * static_cast<double>(track.period_ns);
  const bool in_time =
      track.period_ns == 0 || std::abs(off) < kSurelyNotIn + std::abs(length) / kLeastSure;
  if (!track.restarted) {
    gap.lost = static_cast<std::uint64_t>(steps - 1);
    counts_.lost += *gap.lost;
  }
  bool notable = gap.lost && *gap.lost > 0 && packet.host_ns - track.last_host_ns > kNotableGap;
  if (!same_clock || passed < 0 || (!in_time && !track.paused)) {
    ++counts_.clock_jumps;
    gap.cause = GapCause::clock;
    notable = true;
    if (packet.rows > 0) clock_.jump();
  } else if (!in_time) {
    gap.cause = GapCause::session;
    notable = true;
    if (packet.rows > 0) clock_.jump();
  } else if (steps == 1 && passed > 0 && (track.period_ns == 0 || passed < track.period_ns)) {
    track.period_ns = passed;
  }
  if (notable) note_gap(gap);
}

/// Returns the first of the waiting packets.
void NumberedOrder::give_out(Track& track) {
  const auto first = track.held.begin();
  Held& packet = first->second;
  if (track.last_index) compare(track, packet, first->first);
  if (packet.rows > 0) {
    clock_.add(timestamp_type_of(numbered_time_reference(packet.time_type)), 0, packet.time_ns,
               packet.host_ns);
  }
  track.restarted = track.paused = false;
  track.last_index = first->first;
  track.last_ns = packet.time_ns;
  track.last_host_ns = packet.host_ns;
  track.last_time_type = packet.time_type;
  ++counts_.packets;
  counts_.rows += packet.rows;
  if (packet.rows == 0) ++counts_.imu_samples;
  ready_.push_back(std::move(packet.bytes));
  track.held.erase(first);
}

void NumberedOrder::advance(std::int64_t host_ns) {
  for (Track& track : tracks_) {
    while (!track.held.empty() && host_ns - track.held.begin()->second.host_ns > kLongestWait) {
      give_out(track);
    }
  }
}

void NumberedOrder::flush() {
  for (Track& track : tracks_) {
    while (!track.held.empty()) give_out(track);
    track.flushed = track.paused = true;
  }
}

std::unique_ptr<PacketSequence> packet_sequence(std::uint8_t device_type, bool numbered) {
  if (numbered) return std::make_unique<NumberedOrder>();
  return std::make_unique<PacketOrder>(device_type);
}

}  // namespace risley::recordings::livox
