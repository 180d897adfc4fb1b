// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/packet_order.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace risley::recordings::livox {
namespace {

constexpr std::int64_t kImuPeriod = 5'000'000;         // ns
constexpr std::int64_t kNotableGap = 100'000'000;      // ns
constexpr std::int64_t kSurelyNoJump = 1'000'000'000;  // ns
/// A clock that runs faster than that has jumped: emulated time may be faster than real time.
constexpr std::int64_t kFastestClock = 200;
/// Farther back than packets can be late: the clock began again.
constexpr std::int64_t kFarBack = 1'000'000'000;  // ns
constexpr std::size_t kRemembered = 1024;

/// The checks of a packet do not depend on the sensor, but need a grid.
PacketDecoderOptions decoder_options(std::uint8_t device_type) {
  PacketDecoderOptions options;
  options.device_type = device_type;
  options.grid = kGrid100kHz;
  return options;
}

}  // namespace

PacketOrder::PacketOrder(std::uint8_t device_type)
    : device_type_(device_type), decoder_(decoder_options(device_type)) {}

std::int64_t PacketOrder::period_of(std::uint8_t data_type) const {
  if (data_type == kImuDataType) return kImuPeriod;
  const ShotGrid grid = grid_ ? *grid_ : shot_grid(device_type_, data_type).value_or(kGrid100kHz);
  const std::uint32_t records = record_layout(data_type)->records;
  return grid.offset_ns((records + grid.records_per_shot - 1U) / grid.records_per_shot);
}

bool PacketOrder::add(std::span<const std::uint8_t> packet, std::int64_t host_ns) {
  chunk_.clear();
  try {
    decoder_.decode(packet, chunk_);
  } catch (const BadPacket&) {
    ++counts_.rejected;
    return false;
  }
  if (!first_host_ns_) first_host_ns_ = host_ns;
  const Packet& header = chunk_.packets.front();
  const bool is_imu = header.data_type == kImuDataType;
  Track& track = tracks_[is_imu ? 1 : 0];
  if (track.timestamp_type && *track.timestamp_type != header.timestamp_type) restart(track);
  track.timestamp_type = header.timestamp_type;
  place(track, is_imu ? chunk_.imu.front().time_ns : chunk_.observations.time_ns.front(),
        {{packet.begin(), packet.end()}, host_ns, period_of(header.data_type), header.rows});
  return true;
}

void PacketOrder::restart(Track& track) {
  while (!track.held.empty()) give_out(track);
  track.jumped = track.last_ns.has_value();
  track.recent.clear();
}

void PacketOrder::place(Track& track, std::int64_t time_ns, Held&& packet) {
  if (track.last_ns && !track.jumped) {
    const std::int64_t last =
        track.held.empty() ? *track.last_ns : std::max(*track.last_ns, track.held.rbegin()->first);
    const std::int64_t last_host =
        track.held.empty() ? track.last_host_ns : track.held.rbegin()->second.host_ns;
    const std::int64_t passed = time_ns - last;
    const std::int64_t host_passed = std::max<std::int64_t>(packet.host_ns - last_host, 0);
    if (-passed > kFarBack || (track.flushed && passed <= 0) ||
        (passed > kSurelyNoJump && passed / kFastestClock > host_passed)) {
      restart(track);
    } else if (time_ns <= *track.last_ns) {
      const bool known =
          std::find(track.recent.rbegin(), track.recent.rend(), time_ns) != track.recent.rend();
      ++(known ? counts_.duplicates : counts_.late);
      return;
    }
  }
  track.flushed = false;
  const bool overtaken = !track.held.empty() && time_ns < track.held.rbegin()->first;
  if (!track.held.try_emplace(time_ns, std::move(packet)).second) {
    ++counts_.duplicates;
    return;
  }
  if (overtaken) ++counts_.reordered;
  while (track.held.size() > kWindow) give_out(track);
}

/// Gives out the first packet of those that wait, and counts what is missing before it.
void PacketOrder::give_out(Track& track) {
  const auto first = track.held.begin();
  const std::int64_t time = first->first;
  Held& packet = first->second;
  if (track.last_ns) {
    PacketGap gap{*track.last_ns, time, track.last_host_ns, packet.host_ns, {}, packet.rows == 0};
    bool notable = track.jumped;
    if (track.jumped) {
      ++counts_.clock_jumps;
    } else {
      const double periods =
          static_cast<double>(time - *track.last_ns) / static_cast<double>(track.last_period_ns);
      const auto steps = static_cast<std::uint64_t>(std::max(1LL, std::llround(periods)));
      counts_.lost += steps - 1;
      gap.lost = steps - 1;
      notable = steps > 1 && time - *track.last_ns > kNotableGap;
    }
    if (notable && gaps_.size() < kMostGaps) gaps_.push_back(gap);
  }
  track.jumped = false;
  track.last_ns = time;
  track.last_period_ns = packet.period_ns;
  track.last_host_ns = packet.host_ns;
  track.recent.push_back(time);
  if (track.recent.size() > kRemembered) track.recent.pop_front();
  ++counts_.packets;
  counts_.rows += packet.rows;
  if (packet.rows == 0) ++counts_.imu_samples;
  ready_.push_back(std::move(packet.bytes));
  track.held.erase(first);
}

void PacketOrder::advance(std::int64_t host_ns) {
  for (Track& track : tracks_) {
    while (!track.held.empty() && host_ns - track.held.begin()->second.host_ns > kLongestWait) {
      give_out(track);
    }
  }
}

void PacketOrder::flush() {
  for (Track& track : tracks_) {
    while (!track.held.empty()) give_out(track);
    track.flushed = true;
  }
}

std::vector<std::vector<std::uint8_t>> PacketOrder::take() { return std::exchange(ready_, {}); }

}  // namespace risley::recordings::livox
