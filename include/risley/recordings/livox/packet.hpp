// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The point data packet of Livox's first generation (Mid-40, Mid-70, Avia, Horizon, Tele-15), as
// the sensors send it by UDP and as LVX 1 files keep it: a header of 18 bytes, then a fixed number
// of records. All numbers are little-endian and packed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "risley/recordings/observations.hpp"

namespace risley::recordings::livox {

/// Bytes of the header before the records.
inline constexpr std::size_t kPacketHeaderBytes = 18;
/// The only packet version there is.
inline constexpr std::uint8_t kPacketVersion = 5;
/// The data type that holds an inertial sample and no points.
inline constexpr std::uint8_t kImuDataType = 6;

/// Where the fields of the header begin.
inline constexpr std::size_t kVersionAt = 0,  ///< kPacketVersion, one byte
    kTimestampTypeAt = 8,                     ///< which clock, one byte
    kDataTypeAt = 9,                          ///< see record_layout(), one byte
    kTimestampAt = 10;                        ///< eight bytes

/// Point layout of a data type.
struct RecordLayout {
  bool cartesian, tagged;
  std::uint8_t returns;   ///< per record; 0 for the inertial sample
  std::uint16_t records;  ///< per packet
  std::uint16_t bytes_per_record;

  /// Bytes of all records of a packet.
  std::size_t bytes() const { return std::size_t{records} * bytes_per_record; }
  /// Rows of observations that a packet gives.
  std::size_t rows() const { return std::size_t{records} * returns; }
};

/// Layout of data types 0-8, nullptr for others.
const RecordLayout* record_layout(std::uint8_t data_type);

/// The data type for such shots. @param returns  1-3; two and more need a tag byte
/// @throws InvalidArgument for other numbers of returns
std::uint8_t data_type_of(bool cartesian, bool tagged, int returns);

/// Measurement times and beams of a packet's records.
struct ShotGrid {
  /// Time between two shots as a fraction, ns: 1/240 kHz is no whole number.
  std::uint32_t interval_numerator_ns = 10'000, interval_denominator = 1;
  std::uint8_t beams = 1;
  /// Records that belong to one shot: 1, or 2 and 3 with the Mid-40 firmware that stores several
  /// returns as single-return records.
  std::uint8_t records_per_shot = 1;

  /// Time of a shot after the packet's, rounded to whole ns.
  std::int64_t offset_ns(std::uint32_t shot) const {
    return static_cast<std::int64_t>(
        (std::uint64_t{shot} * interval_numerator_ns + interval_denominator / 2) /
        interval_denominator);
  }
};

/// Single-beam sensors: a shot every 10 microseconds.
inline constexpr ShotGrid kGrid100kHz{10'000, 1, 1, 1};
/// Sensors with six beams: a shot every 12500/3 ns.
inline constexpr ShotGrid kGrid240kHz{12'500, 3, 6, 1};

/// Mid-40 firmware with two returns of a shot as separate records.
inline constexpr ShotGrid kGridOfTwo{10'000, 1, 1, 2};
/// The same with three.
inline constexpr ShotGrid kGridOfThree{50'000, 3, 1, 3};

/// Grid of a device type and data type, empty if they do not imply one.
std::optional<ShotGrid> shot_grid(std::uint8_t device_type, std::uint8_t data_type);

/// Whether sensors of this type send inertial samples. @param device_type  Device::type
bool has_imu(std::uint8_t device_type);

/// Shots of the Mid-40 firmware that stores several returns as separate records, empty for others.
/// @param firmware  "03.03.0001"
std::optional<ShotGrid> grid_of_firmware(std::string_view firmware);

/// Origin of the times of a timestamp type.
TimeReference time_reference_of(std::uint8_t timestamp_type);

/// Times of the packets of one device, made continuous if the sensor counts from the last PPS edge.
class PacketClock {
 public:
  /// Time of the packet's first shot, ns; UTC since 1970 for GPS times. Empty if its bytes are not
  /// a time, or one so late that its last shot does not fit 64 bits; the clock is then unchanged.
  std::optional<std::int64_t> time_ns(const Packet& packet);

  /// New seconds seen in PPS times.
  std::uint64_t wraps() const { return wraps_; }

 private:
  std::optional<std::int64_t> pps_time(std::int64_t since_edge_ns);

  std::int64_t second_ns_ = 0;  // time of the last PPS edge
  std::int64_t last_since_edge_ns_ = 0;
  std::uint64_t wraps_ = 0;
};

}  // namespace risley::recordings::livox
