// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/packet.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>

#include "risley/core/require.hpp"
#include "risley/io/little_endian.hpp"

namespace risley::recordings::livox {
namespace {

using io::load;

constexpr std::array<RecordLayout, 9> kLayouts{{
    {true, false, 1, 100, 13},
    {false, false, 1, 100, 9},
    {true, true, 1, 96, 14},
    {false, true, 1, 96, 10},
    {true, true, 2, 48, 28},
    {false, true, 2, 48, 16},
    {false, false, 0, 1, 24},
    {true, true, 3, 30, 42},
    {false, true, 3, 30, 22},
}};

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kHour = 3600 * kSecond;
/// A packet's last shot is later than its first: room for it is reserved.
constexpr std::int64_t kLatest = std::numeric_limits<std::int64_t>::max() - kHour;

}  // namespace

const RecordLayout* record_layout(std::uint8_t data_type) {
  return data_type < kLayouts.size() ? &kLayouts[data_type] : nullptr;
}

std::uint8_t data_type_of(bool cartesian, bool tagged, int returns) {
  require_between("returns per shot", returns, 1, 3);
  const auto found =
      std::find_if(kLayouts.begin(), kLayouts.end(), [&](const RecordLayout& layout) {
        return layout.cartesian == cartesian && layout.returns == returns &&
               layout.tagged == (tagged || returns > 1);
      });
  return static_cast<std::uint8_t>(found - kLayouts.begin());
}

std::optional<ShotGrid> shot_grid(std::uint8_t device_type, std::uint8_t data_type) {
  const LivoxType* type = livox_type(device_type);
  if (type != nullptr && !type->first_generation) return std::nullopt;
  if (data_type < 2) return kGrid100kHz;
  if (type != nullptr) {
    return type->fast ? kGrid240kHz : kGrid100kHz;
  }
  if (data_type > kImuDataType) return kGrid240kHz;  // only the Avia has three returns
  return std::nullopt;
}

bool has_imu(std::uint8_t device_type) {
  const LivoxType* type = livox_type(device_type);
  return type != nullptr && type->fast;
}

std::optional<ShotGrid> grid_of_firmware(std::string_view firmware) {
  if (firmware == "03.03.0001" || firmware == "03.03.0006") return kGridOfTwo;
  if (firmware == "03.03.0002" || firmware == "03.03.0007") return kGridOfThree;
  return std::nullopt;
}

TimeReference time_reference_of(std::uint8_t timestamp_type) {
  switch (timestamp_type) {
    case 1:
      return TimeReference::ptp;
    case 3:
      return TimeReference::utc;
    case 4:
      return TimeReference::pps;
    default:
      return TimeReference::power_on;
  }
}

std::optional<std::int64_t> PacketClock::time_ns(const Packet& packet) {
  const std::uint8_t* bytes = packet.timestamp.data();
  if (packet.timestamp_type > 5) return std::nullopt;
  if (packet.timestamp_type == 3) {
    using namespace std::chrono;
    const year_month_day date{year{2000 + bytes[0]}, month{bytes[1]}, day{bytes[2]}};
    if (!date.ok() || bytes[3] > 23) return std::nullopt;
    const auto since_epoch = sys_days{date}.time_since_epoch();
    return nanoseconds{since_epoch}.count() + bytes[3] * kHour +
           std::int64_t{load<std::uint32_t>(bytes + 4)} * 1000;
  }
  const auto raw = load<std::uint64_t>(bytes);
  if (raw > static_cast<std::uint64_t>(kLatest)) return std::nullopt;
  const auto time = static_cast<std::int64_t>(raw);
  return packet.timestamp_type == 4 ? pps_time(time) : time;
}

std::optional<std::int64_t> PacketClock::pps_time(std::int64_t since_edge_ns) {
  // Packets may overtake each other on the network by a few ms; any longer step is an edge, even if
  // the packets just after it were lost.
  constexpr std::int64_t kDisorder = 10'000'000, kAfterEdge = 1'000'000;
  const std::int64_t back = last_since_edge_ns_ - since_edge_ns;
  std::int64_t second_ns = second_ns_;
  const bool is_edge = back > kDisorder || (since_edge_ns < kAfterEdge && back > kAfterEdge);
  if (is_edge) {
    // Edges may have been missed, and the sensor's second may be a little longer than a second.
    const std::int64_t seconds = (last_since_edge_ns_ - kDisorder + kSecond - 1) / kSecond;
    const std::int64_t passed_ns = std::max<std::int64_t>(seconds, 1) * kSecond;
    if (second_ns > kLatest - passed_ns) return std::nullopt;
    second_ns += passed_ns;
  } else if (last_since_edge_ns_ < kAfterEdge && -back > kSecond - kDisorder &&
             since_edge_ns < kSecond && second_ns > 0) {
    return second_ns - kSecond + since_edge_ns;  // overtaken by the first packet of the second
  }
  if (since_edge_ns > kLatest - second_ns) return std::nullopt;
  if (is_edge) {
    second_ns_ = second_ns;
    ++wraps_;
  }
  if (is_edge || back <= 0) last_since_edge_ns_ = since_edge_ns;
  return second_ns + since_edge_ns;
}

}  // namespace risley::recordings::livox
