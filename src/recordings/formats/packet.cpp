// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/packet.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"

#include "recordings/formats/cartesian.hpp"

namespace risley::recordings {
namespace {

using io::load;
using io::store;

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

constexpr int kHalfTurn = 18'000, kFullTurn = 36'000;  // 0.01 deg
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kHour = 3600 * kSecond;

/// Where the numbers of a record with this many returns stand. Records of one return begin with
/// the distance, records of several with the angles.
constexpr std::size_t zenith_at(int returns) { return returns == 1 ? 4 : 0; }
constexpr std::size_t depth_at(int returns, int number) {
  return returns == 1 ? 0 : 4 + 6 * static_cast<std::size_t>(number);
}
constexpr std::size_t intensity_at(int returns, int number) {
  return returns == 1 ? 8 : depth_at(returns, number) + 4;
}

template <int kReturns, bool kTagged>
std::optional<std::size_t> decode_spherical(std::size_t records, const std::uint8_t* bytes,
                                            Observations& o, std::size_t row) {
  constexpr std::size_t kBytes = kReturns == 1 ? (kTagged ? 10 : 9) : 4 + 6 * kReturns;
  for (std::size_t record = 0; record < records; ++record, bytes += kBytes) {
    const int zenith = load<std::uint16_t>(bytes + zenith_at(kReturns));
    const int azimuth = load<std::uint16_t>(bytes + zenith_at(kReturns) + 2);
    const bool possible = zenith <= kHalfTurn && azimuth <= kFullTurn;
    // Beyond a full turn stand only angles that nobody trusts; they are kept as they are.
    const bool over_half = azimuth > kHalfTurn && azimuth <= kFullTurn;
    const double azimuth_rad =
        azimuth == kHalfTurn
            ? kPi
            : radians_from_degrees((over_half ? azimuth - kFullTurn : azimuth) / 100.0);
    const double zenith_rad =
        std::min(radians_from_degrees(zenith / 100.0), zenith <= kHalfTurn ? kPi : 1e3);
    for (int number = 0; number < kReturns; ++number, ++row) {
      const auto depth = load<std::uint32_t>(bytes + depth_at(kReturns, number));
      if (depth > 0 && !possible) return record;
      set_spherical(o, row, azimuth_rad, zenith_rad, depth * kMillimetre);
      o.intensity[row] = bytes[intensity_at(kReturns, number)];
      o.tag[row] = kTagged ? bytes[intensity_at(kReturns, number) + 1] : 0;
    }
  }
  return std::nullopt;
}

template <bool kTagged>
void decode_cartesian(std::size_t points, const std::uint8_t* bytes, Observations& o,
                      std::size_t row) {
  constexpr std::size_t kBytes = kTagged ? 14 : 13;
  for (const std::size_t end = row + points; row < end; ++row, bytes += kBytes) {
    set_cartesian(
        o, row,
        {load<std::int32_t>(bytes) * kMillimetre, load<std::int32_t>(bytes + 4) * kMillimetre,
         load<std::int32_t>(bytes + 8) * kMillimetre},
        kMillimetre);
    o.intensity[row] = bytes[12];
    o.tag[row] = kTagged ? bytes[13] : 0;
  }
}

[[noreturn]] void refuse(std::uint64_t row, const char* column, double value, const char* unit,
                         const char* allowed) {
  throw InvalidArgument(
      fmt::format("row {}: {} = {} {}, allowed {}", row, column, value, unit, allowed));
}

/// Whether a row holds a return; checks everything a record of any kind needs.
bool has_return(const Observations& o, std::size_t row, std::uint64_t row_number) {
  if (!o.valid[row]) return false;
  const double range = o.range[row];
  if (std::isnan(range)) {
    throw InvalidArgument(fmt::format(
        "row {}: range is missing, but a packet record without range means that there was no "
        "return; only recordings with ranges can be written in this format",
        row_number));
  }
  if (range == 0) return false;
  if (!(range > 0)) refuse(row_number, "range", range, "m", "[0, 4294967.295] m");
  constexpr double kSlack = 0.5 * kCentidegree;  // rounds to the limit
  if (!(o.zenith[row] >= -kSlack && o.zenith[row] < kPi + kSlack)) {
    refuse(row_number, "zenith", degrees_from_radians(o.zenith[row]), "deg", "[0, 180] deg");
  }
  if (!(std::fabs(o.azimuth[row]) < kPi + kSlack)) {
    refuse(row_number, "azimuth", degrees_from_radians(o.azimuth[row]), "deg", "[-180, 180] deg");
  }
  return true;
}

/// The integer of an angle that a record without return holds, 0 for none.
std::uint16_t untrusted_angle(double angle, int limit) {
  const double units = std::round(degrees_from_radians(angle) * 100.0);
  return units >= 0 && units <= limit ? static_cast<std::uint16_t>(units) : std::uint16_t{0};
}

struct RawAngles {
  std::uint16_t zenith = 0, azimuth = 0;
  friend bool operator==(const RawAngles&, const RawAngles&) = default;
};

RawAngles raw_angles(const Observations& o, std::size_t row, bool trusted) {
  const double azimuth = o.azimuth[row];
  if (!trusted) {
    constexpr int kLimit = std::numeric_limits<std::uint16_t>::max();
    RawAngles raw{untrusted_angle(o.zenith[row], kLimit), 0};
    // A negative azimuth that rounds to no step is 0, not a full turn.
    const bool negative = azimuth <= -0.5 * kCentidegree;
    raw.azimuth = untrusted_angle(negative ? azimuth + kTwoPi : std::fabs(azimuth), kLimit);
    if (raw.azimuth == kFullTurn) raw.azimuth = 0;
    return raw;
  }
  const auto zenith = std::lround(degrees_from_radians(o.zenith[row]) * 100.0);
  const auto azimuth_steps = std::lround(degrees_from_radians(azimuth) * 100.0);
  return {
      static_cast<std::uint16_t>(zenith),
      static_cast<std::uint16_t>(azimuth_steps < 0 ? azimuth_steps + kFullTurn : azimuth_steps)};
}

void encode_spherical(const RecordLayout& layout, const Observations& o, std::size_t first_row,
                      std::uint64_t row_number, std::uint8_t* bytes) {
  RawAngles angles = raw_angles(o, first_row, false);
  bool angles_known = false;
  for (int number = 0; number < layout.returns; ++number) {
    const std::size_t row = first_row + static_cast<std::size_t>(number);
    const std::uint64_t message_row = row_number + static_cast<std::uint64_t>(number);
    std::uint32_t depth = 0;
    if (has_return(o, row, message_row)) {
      const double steps = std::round(o.range[row] / kMillimetre);
      if (!(steps >= 1 && steps <= std::numeric_limits<std::uint32_t>::max())) {
        refuse(message_row, "range", o.range[row], "m",
               "0 for no return or [0.0005, 4294967.295] m");
      }
      depth = static_cast<std::uint32_t>(steps);
      const RawAngles own = raw_angles(o, row, true);
      if (angles_known && own != angles) {
        throw InvalidArgument(fmt::format(
            "row {}: azimuth = {} deg, zenith = {} deg differ from those of the same shot's other "
            "return; a spherical record holds one direction per shot",
            message_row, degrees_from_radians(o.azimuth[row]),
            degrees_from_radians(o.zenith[row])));
      }
      angles = own;
      angles_known = true;
    }
    store<std::uint32_t>(bytes + depth_at(layout.returns, number), depth);
    std::uint8_t* intensity = bytes + intensity_at(layout.returns, number);
    intensity[0] = o.intensity[row];
    if (layout.tagged) intensity[1] = o.tag[row];
  }
  store<std::uint16_t>(bytes + zenith_at(layout.returns), angles.zenith);
  store<std::uint16_t>(bytes + zenith_at(layout.returns) + 2, angles.azimuth);
}

void encode_cartesian(const RecordLayout& layout, const Observations& o, std::size_t first_row,
                      std::uint64_t row_number, std::uint8_t* bytes) {
  const std::size_t bytes_per_point = layout.tagged ? 14 : 13;
  for (int number = 0; number < layout.returns; ++number, bytes += bytes_per_point) {
    const std::size_t row = first_row + static_cast<std::size_t>(number);
    const std::uint64_t message_row = row_number + static_cast<std::uint64_t>(number);
    std::array<std::int32_t, 3> steps{};
    if (has_return(o, row, message_row)) {
      const Vector3<double> point = cartesian_point(o, row);
      const std::array<double, 3> exact{point.x, point.y, point.z};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double rounded = std::round(exact[axis] / kMillimetre);
        if (!(std::fabs(rounded) <= std::numeric_limits<std::int32_t>::max()) &&
            rounded != std::numeric_limits<std::int32_t>::min()) {
          refuse(message_row, "range", o.range[row], "m",
                 "coordinates in [-2147483.648, 2147483.647] m");
        }
        steps[axis] = static_cast<std::int32_t>(rounded);
      }
      if (steps == std::array<std::int32_t, 3>{}) {
        refuse(message_row, "range", o.range[row], "m",
               "0 for no return or at least one coordinate of 0.0005 m");
      }
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      store<std::int32_t>(bytes + 4 * axis, steps[axis]);
    }
    bytes[12] = o.intensity[row];
    if (layout.tagged) bytes[13] = o.tag[row];
  }
}

}  // namespace

const RecordLayout* record_layout(std::uint8_t data_type) {
  return data_type < kLayouts.size() ? &kLayouts[data_type] : nullptr;
}

std::uint8_t data_type_of(bool cartesian, bool tagged, int returns) {
  for (std::size_t type = 0; type < kLayouts.size(); ++type) {
    const RecordLayout& layout = kLayouts[type];
    if (layout.cartesian == cartesian && layout.returns == returns &&
        layout.tagged == (tagged || returns > 1)) {
      return static_cast<std::uint8_t>(type);
    }
  }
  throw InvalidArgument(fmt::format("returns per shot = {}, allowed 1 to 3", returns));
}

std::optional<ShotGrid> shot_grid(std::uint8_t device_type, std::uint8_t data_type) {
  if (data_type < 2) return kGrid100kHz;
  switch (device_type) {
    case 1:
    case 6:
      return kGrid100kHz;
    case 2:
    case 3:
    case 7:
      return kGrid240kHz;
    default:
      break;
  }
  if (data_type > kImuDataType) return kGrid240kHz;  // only the Avia has three returns
  return std::nullopt;
}

void encode_packet_header(const Packet& packet, std::uint8_t* bytes) {
  bytes[0] = packet.version;
  bytes[1] = packet.slot;
  bytes[2] = packet.lidar_id;
  bytes[3] = packet.reserved;
  store<std::uint32_t>(bytes + 4, packet.status);
  bytes[8] = packet.timestamp_type;
  bytes[9] = packet.data_type;
  std::copy(packet.timestamp.begin(), packet.timestamp.end(), bytes + 10);
}

Packet decode_packet_header(const std::uint8_t* bytes) {
  Packet packet;
  packet.version = bytes[0];
  packet.slot = bytes[1];
  packet.lidar_id = bytes[2];
  packet.reserved = bytes[3];
  packet.status = load<std::uint32_t>(bytes + 4);
  packet.timestamp_type = bytes[8];
  packet.data_type = bytes[9];
  std::copy_n(bytes + 10, packet.timestamp.size(), packet.timestamp.begin());
  return packet;
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

std::uint8_t timestamp_type_of(TimeReference reference) {
  switch (reference) {
    case TimeReference::ptp:
      return 1;
    case TimeReference::utc:
      return 3;
    case TimeReference::pps:
      return 4;
    case TimeReference::relative:
    case TimeReference::power_on:
      return 0;
  }
  return 0;
}

std::array<std::uint8_t, 8> encode_timestamp(std::uint8_t timestamp_type, std::int64_t time_ns) {
  if (time_ns < 0) {
    throw InvalidArgument(fmt::format("time = {} ns, allowed 0 or later", time_ns));
  }
  std::array<std::uint8_t, 8> bytes{};
  if (timestamp_type == 4) {
    store<std::uint64_t>(bytes.data(), static_cast<std::uint64_t>(time_ns % kSecond));
    return bytes;
  }
  if (timestamp_type != 3) {
    store<std::uint64_t>(bytes.data(), static_cast<std::uint64_t>(time_ns));
    return bytes;
  }
  using namespace std::chrono;
  const std::int64_t time_us = time_ns / 1000 + (time_ns % 1000 >= 500 ? 1 : 0);
  const sys_time<microseconds> time{microseconds{time_us}};
  const auto day = floor<days>(time);
  const year_month_day date{day};
  const int year = static_cast<int>(date.year());
  if (year < 2000 || year > 2255) {
    throw InvalidArgument(fmt::format(
        "time = {} ns since 1970 lies in the year {}, allowed 2000 to 2255", time_ns, year));
  }
  const auto hour = floor<hours>(time - day);
  bytes[0] = static_cast<std::uint8_t>(year - 2000);
  bytes[1] = static_cast<std::uint8_t>(static_cast<unsigned>(date.month()));
  bytes[2] = static_cast<std::uint8_t>(static_cast<unsigned>(date.day()));
  bytes[3] = static_cast<std::uint8_t>(hour.count());
  store<std::uint32_t>(bytes.data() + 4, static_cast<std::uint32_t>((time - day - hour).count()));
  return bytes;
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
  // A packet's last shot is later than its first: leave room for it.
  if (raw > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max() - kHour)) {
    return std::nullopt;
  }
  const auto time = static_cast<std::int64_t>(raw);
  return packet.timestamp_type == 4 ? pps_time(time) : time;
}

std::int64_t PacketClock::pps_time(std::int64_t since_edge_ns) {
  // Packets may overtake each other on the network by a few ms; everything longer is an edge,
  // also when the packets just after it were lost.
  constexpr std::int64_t kDisorder = 10'000'000, kAfterEdge = 1'000'000;
  const std::int64_t back = last_since_edge_ns_ - since_edge_ns;
  if (back > kDisorder || (since_edge_ns < kAfterEdge && back > kAfterEdge)) {
    // Edges may have been missed, and the sensor's second may be a little longer than a second.
    const std::int64_t seconds = (last_since_edge_ns_ - kDisorder + kSecond - 1) / kSecond;
    second_ns_ += std::max<std::int64_t>(seconds, 1) * kSecond;
    ++wraps_;
  } else if (last_since_edge_ns_ < kAfterEdge && -back > kSecond - kDisorder &&
             since_edge_ns < kSecond && second_ns_ > 0) {
    return second_ns_ - kSecond + since_edge_ns;  // overtaken by the first packet of the second
  } else if (back > 0) {
    return second_ns_ + since_edge_ns;
  }
  last_since_edge_ns_ = since_edge_ns;
  return second_ns_ + since_edge_ns;
}

std::optional<std::size_t> decode_records(const RecordLayout& layout, const std::uint8_t* bytes,
                                          std::int64_t time_ns, const ShotGrid& grid,
                                          std::uint8_t device, Observations& observations,
                                          std::size_t first_row) {
  Observations& o = observations;
  const std::size_t records = layout.records;
  std::optional<std::size_t> impossible;
  if (layout.cartesian) {
    if (layout.tagged) {
      decode_cartesian<true>(layout.rows(), bytes, o, first_row);
    } else {
      decode_cartesian<false>(layout.rows(), bytes, o, first_row);
    }
  } else if (layout.returns == 1) {
    impossible = layout.tagged ? decode_spherical<1, true>(records, bytes, o, first_row)
                               : decode_spherical<1, false>(records, bytes, o, first_row);
  } else {
    impossible = layout.returns == 2 ? decode_spherical<2, true>(records, bytes, o, first_row)
                                     : decode_spherical<3, true>(records, bytes, o, first_row);
  }

  // Rows of one shot follow each other, whether one record holds them or several.
  const std::uint32_t rows_per_shot = std::uint32_t{layout.returns} * grid.records_per_shot;
  std::uint32_t shot = 0;
  for (std::size_t row = first_row, end = first_row + layout.rows(); row < end; ++shot) {
    const std::int64_t shot_time = time_ns + grid.offset_ns(shot);
    const auto beam = static_cast<std::uint8_t>(grid.beams == 1 ? 0 : shot % grid.beams);
    for (std::uint32_t number = 1; number <= rows_per_shot && row < end; ++number, ++row) {
      o.time_ns[row] = shot_time;
      o.beam[row] = beam;
      o.return_number[row] = static_cast<std::uint8_t>(number);
    }
  }
  const auto rows = static_cast<std::ptrdiff_t>(layout.rows());
  std::fill_n(o.device.begin() + static_cast<std::ptrdiff_t>(first_row), rows, device);
  return impossible;
}

void encode_record(const RecordLayout& layout, const Observations& observations,
                   std::size_t first_row, std::uint64_t row_number, std::uint8_t* bytes) {
  if (!layout.tagged && observations.tag[first_row] != 0) {
    refuse(row_number, "tag", observations.tag[first_row], "", "0 in data types 0 and 1");
  }
  if (layout.cartesian) {
    encode_cartesian(layout, observations, first_row, row_number, bytes);
  } else {
    encode_spherical(layout, observations, first_row, row_number, bytes);
  }
}

ImuSample decode_imu(const std::uint8_t* bytes) {
  ImuSample sample;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sample.angular_velocity[axis] = load<float>(bytes + 4 * axis);
    sample.acceleration_g[axis] = load<float>(bytes + 12 + 4 * axis);
  }
  return sample;
}

void encode_imu(const ImuSample& sample, std::uint8_t* bytes) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    store<float>(bytes + 4 * axis, sample.angular_velocity[axis]);
    store<float>(bytes + 12 + 4 * axis, sample.acceleration_g[axis]);
  }
}

}  // namespace risley::recordings
