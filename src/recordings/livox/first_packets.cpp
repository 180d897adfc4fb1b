// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/first_packets.hpp"

#include <algorithm>
#include <cmath>

namespace risley::recordings::livox {
namespace {

/// Between 10 us, the shots of single-beam sensors, and 4.2 us, those of the others.
constexpr double kBetween_ns = 7000;

}  // namespace

void FirstPackets::add(const Packet& packet, const Observations& rows, std::size_t first_row) {
  const std::int64_t time = rows.time_ns[first_row];
  if (last_time_ns_ && data_type_ == packet.data_type && time > *last_time_ns_) {
    shortest_period_ns_ = std::min(shortest_period_ns_, time - *last_time_ns_);
  }
  last_time_ns_ = time;
  data_type_ = packet.data_type;
  if (packet.data_type >= 2) return;
  for (std::size_t i = 0; i < packet.rows; ++i) {
    const std::size_t row = first_row + i;
    if (!rows.valid[row]) continue;
    for (std::size_t n = 2; n <= 3; ++n) {
      if (i % n == 0) continue;
      ++(rows.intensity[row] == (i % n == 1 ? 200 : 250) ? fitting_ : contradicting_)[n];
    }
  }
}

double FirstPackets::interval_ns() const {
  return static_cast<double>(shortest_period_ns_) / record_layout(data_type_)->records;
}

std::optional<ShotGrid> FirstPackets::grid(std::uint8_t device_type) const {
  if (empty()) return std::nullopt;
  if (!shot_grid(device_type, data_type_)) {
    return interval_ns() < kBetween_ns ? kGrid240kHz : kGrid100kHz;
  }
  if (data_type_ >= 2) return std::nullopt;
  // 50 shots of two records in 500 us, or 34 shots of three in 567 us (the last is cut).
  constexpr std::size_t kEnough = 10;
  constexpr double kTolerance = 0.04;
  const auto is_interleaved = [&](std::size_t n, double period_ns) {
    return std::fabs(static_cast<double>(shortest_period_ns_) - period_ns) <
               kTolerance * period_ns &&
           fitting_[n] >= kEnough && contradicting_[n] == 0;
  };
  if (is_interleaved(3, 566'667)) return kGridOfThree;
  if (is_interleaved(2, 500'000)) return kGridOfTwo;
  return std::nullopt;
}

std::uint8_t FirstPackets::device_type() const {
  if (empty()) return kUnknownDeviceType;
  if (data_type_ < 2) return kMid40;
  if (data_type_ > kImuDataType) return kAvia;
  const bool known = shortest_period_ns_ < std::numeric_limits<std::int64_t>::max();
  return known && interval_ns() > kBetween_ns ? kMid70 : kUnknownDeviceType;
}

}  // namespace risley::recordings::livox
