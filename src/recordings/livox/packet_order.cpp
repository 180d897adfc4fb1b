// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/packet_order.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <string_view>
#include <utility>

#include "risley/core/saturating.hpp"
#include "risley/io/little_endian.hpp"

namespace risley::recordings::livox {
namespace {

constexpr std::int64_t kImuPeriod = 5'000'000;         // ns
constexpr std::int64_t kSurelyNoJump = 1'000'000'000;  // ns
/// A clock that runs faster than that has jumped: emulated time may be faster than real time.
constexpr std::int64_t kFastestClock = 200;
/// Farther back than packets can be late: the clock restarted.
constexpr std::int64_t kFarBack = 1'000'000'000;  // ns
constexpr std::size_t kRemembered = 1024;
/// This many consecutive late packets mean that the clock was set back.
constexpr std::size_t kSetBack = 16;
/// Delays of packets differ by less on a network that is not overloaded.
constexpr std::int64_t kSurelyEarly = 10'000'000;            // ns
constexpr std::int64_t kRememberedArrivals = 2'000'000'000;  // ns
constexpr std::uint8_t kPps = 4;                             // Packet::timestamp_type
constexpr std::int64_t kPpsPeriod = 1'000'000'000;           // ns
constexpr std::size_t kStatusAt = 4;                         // of a packet

std::size_t hash_of(const std::vector<std::uint8_t>& bytes) {
  return std::hash<std::string_view>()({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

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
  counts_.late += track.late.size();
  track.late.clear();
  track.jumped = track.last_ns.has_value();
  track.recent.clear();
}

void PacketOrder::Arrivals::add(std::int64_t time_ns, std::int64_t host_ns) {
  const std::int64_t offset = saturating_difference(time_ns, host_ns);
  if (empty) {
    *this = {time_ns, host_ns, time_ns, host_ns, offset, offset, host_ns, false};
  } else if (host_ns - turn_ns > kRememberedArrivals) {
    offset_before_ns = std::exchange(offset_ns, offset);
    turn_ns = host_ns;
  }
  offset_ns = std::max(offset_ns, offset);
  last_time_ns = time_ns;
  last_host_ns = host_ns;
}

bool PacketOrder::Arrivals::in_real_time() const {
  // The first packets may have come late.
  constexpr double kFewestNs = 1e9, kTolerance = 0.02, kLatestNs = 0.25e9;
  const auto host = static_cast<double>(last_host_ns - first_host_ns);
  const auto sensor = static_cast<double>(last_time_ns - first_time_ns);
  return !empty && host > kFewestNs && std::abs(sensor - host) < kTolerance * host + kLatestNs;
}

std::int64_t PacketOrder::Arrivals::early_ns(std::int64_t time_ns, std::int64_t host_ns) const {
  return saturating_difference(saturating_difference(time_ns, host_ns),
                               std::max(offset_ns, offset_before_ns));
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
      place_late(track, time_ns, std::move(packet));
      return;
    }
  }
  counts_.late += track.late.size();
  track.late.clear();
  track.flushed = false;
  const bool overtaken = !track.held.empty() && time_ns < track.held.rbegin()->first;
  if (const auto same = track.held.find(time_ns); same != track.held.end()) {
    if (same->second.bytes == packet.bytes) {
      ++counts_.duplicates;
      return;
    }
    restart(track);  // no packet comes twice with other points
  }
  track.held.try_emplace(time_ns, std::move(packet));
  if (overtaken) ++counts_.reordered;
  while (track.held.size() > kWindow) give_out(track);
}

/// A packet with a time already returned: it is a duplicate, or late, or the clock was set back.
void PacketOrder::place_late(Track& track, std::int64_t time_ns, Held&& packet) {
  const Mark mark{time_ns, hash_of(packet.bytes)};
  if (std::find(track.recent.rbegin(), track.recent.rend(), mark) != track.recent.rend()) {
    ++counts_.duplicates;
    return;
  }
  track.late.emplace_back(time_ns, std::move(packet));
  if (track.late.size() < kSetBack) return;
  auto again = std::exchange(track.late, {});
  restart(track);
  for (auto& [time, held] : again) place(track, time, std::move(held));
}

/// Time from the last packet to this one, ns.
std::int64_t PacketOrder::passed_ns(const Track& track, std::int64_t time_ns,
                                    const Held& packet) const {
  const std::int64_t passed = time_ns - *track.last_ns;
  if (track.timestamp_type != kPps || !track.arrivals.in_real_time()) return passed;
  // Of PPS times the whole seconds of a silence are known only from the host's clock.
  const double unseen = static_cast<double>(packet.host_ns) -
                        static_cast<double>(track.last_host_ns) - static_cast<double>(passed);
  const std::int64_t seconds = std::llround(unseen / static_cast<double>(kPpsPeriod));
  return saturating_sum(passed, std::max<std::int64_t>(seconds, 0) * kPpsPeriod);
}

/// Returns the first of the waiting packets, and counts the missing ones before it.
void PacketOrder::give_out(Track& track) {
  const auto first = track.held.begin();
  const std::int64_t time = first->first;
  Held& packet = first->second;
  if (track.last_ns) {
    PacketGap gap{*track.last_ns, time, track.last_host_ns, packet.host_ns, {}, packet.rows == 0};
    const std::int64_t passed = passed_ns(track, time, packet);
    const double periods = static_cast<double>(passed) / static_cast<double>(track.last_period_ns);
    const auto missing = static_cast<std::uint64_t>(std::max(1LL, std::llround(periods))) - 1;
    if (missing > 0 && !track.paused && track.arrivals.in_real_time()) {
      const std::int64_t early =
          track.arrivals.early_ns(saturating_sum(*track.last_ns, passed), packet.host_ns);
      track.jumped = track.jumped || (early > kSurelyEarly && early > passed / 2);
    }
    bool notable = true;
    if (track.jumped) {
      ++counts_.clock_jumps;
      gap.cause = GapCause::clock;
    } else if (track.paused) {
      gap.cause = GapCause::session;
      gap.lost = missing;
      notable = missing > 0;
    } else {
      counts_.lost += missing;
      gap.lost = missing;
      notable = missing > 0 && passed > kNotableGap;
    }
    if (notable) note_gap(gap);
  }
  if (track.jumped) track.arrivals = {};
  track.arrivals.add(time, packet.host_ns);
  if (packet.rows > 0) {
    if (track.jumped || track.paused) clock_.jump();
    clock_.add(packet.bytes[kTimestampTypeAt], io::load<std::uint32_t>(&packet.bytes[kStatusAt]),
               time, packet.host_ns);
  }
  track.paused = false;
  track.jumped = false;
  track.last_ns = time;
  track.last_period_ns = packet.period_ns;
  track.last_host_ns = packet.host_ns;
  track.recent.emplace_back(time, hash_of(packet.bytes));
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
    counts_.late += track.late.size();
    track.late.clear();
    track.flushed = track.paused = true;
  }
}

std::vector<std::vector<std::uint8_t>> PacketSequence::take() { return std::exchange(ready_, {}); }

}  // namespace risley::recordings::livox
