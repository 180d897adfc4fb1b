// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/packet_encoder.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"

#include "recordings/formats/cartesian.hpp"
#include "recordings/livox/spherical_record.hpp"

namespace risley::recordings::livox {
namespace {

using io::store;

[[noreturn]] void refuse(std::uint64_t row, const char* column, double value, const char* unit,
                         const char* allowed) {
  throw InvalidArgument(
      fmt::format("row {}: {} = {} {}, allowed {}", row, column, value, unit, allowed));
}

/// Whether a row holds a return; checks the requirements of any kind of record.
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

/// The integer of an angle in a record without return, 0 for none.
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
    // A negative azimuth that rounds to zero steps is 0, not a full turn.
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
    store<std::uint64_t>(bytes.data(), static_cast<std::uint64_t>(time_ns % 1'000'000'000));
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

void encode_imu(const ImuSample& sample, std::uint8_t* bytes) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    store<float>(bytes + 4 * axis, sample.angular_velocity[axis]);
    store<float>(bytes + 12 + 4 * axis, sample.acceleration_g[axis]);
  }
}

}  // namespace risley::recordings::livox
