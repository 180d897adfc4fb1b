// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "risley/recordings/observations.hpp"

namespace risley::recordings {

/// Bytes of the header in front of the records of a sensor data packet.
inline constexpr std::size_t kPacketHeaderBytes = 18;
/// The only packet version there is.
inline constexpr std::uint8_t kPacketVersion = 5;
/// Largest packet that any data type has, without its header.
inline constexpr std::size_t kMaxRecordBytes = 1344;
/// The data type that holds an inertial sample and no points.
inline constexpr std::uint8_t kImuDataType = 6;

/// How a data type stores its points. All numbers are little-endian and packed.
struct RecordLayout {
  bool cartesian, tagged;
  std::uint8_t returns;   ///< per shot; 0 for the inertial sample
  std::uint16_t records;  ///< per packet
  std::uint16_t bytes_per_record;

  std::size_t bytes() const { return std::size_t{records} * bytes_per_record; }
  std::size_t rows() const { return std::size_t{records} * returns; }
};

/// Layout of data types 0-8, nullptr for others.
const RecordLayout* record_layout(std::uint8_t data_type);

/// The data type that stores such shots. @param returns  1-3; two and more need a tag byte
std::uint8_t data_type_of(bool cartesian, bool tagged, int returns);

/// When the records of a packet were measured, and by which beam.
struct ShotGrid {
  /// Time between two shots as a fraction, ns: 1/240 kHz is no whole number.
  std::uint32_t interval_numerator_ns = 10'000, interval_denominator = 1;
  std::uint8_t beams = 1;
  /// Records that belong to one shot: 1, or 2 and 3 with the Mid-40 firmware that stores several
  /// returns as single-return records.
  std::uint8_t records_per_shot = 1;

  /// Time of a shot after the packet's, rounded to whole ns.
  std::int64_t offset_ns(std::uint32_t shot) const {
    return (shot * interval_numerator_ns + interval_denominator / 2) / interval_denominator;
  }
};

inline constexpr ShotGrid kGrid100kHz{10'000, 1, 1, 1};
inline constexpr ShotGrid kGrid240kHz{12'500, 3, 6, 1};

/// Grid of a device type and data type, empty when the two do not tell.
std::optional<ShotGrid> shot_grid(std::uint8_t device_type, std::uint8_t data_type);

/// Packet header <-> bytes [kPacketHeaderBytes]. rows, frame and device_index stand elsewhere.
void encode_packet_header(const Packet& packet, std::uint8_t* bytes);
Packet decode_packet_header(const std::uint8_t* bytes);

/// What the origin of times of a timestamp type is.
TimeReference time_reference_of(std::uint8_t timestamp_type);
std::uint8_t timestamp_type_of(TimeReference reference);

/// The eight timestamp bytes of a time, ns. GPS times (type 3) are rounded to whole us; PPS times
/// (type 4) keep only the part since the last whole second.
/// @throws InvalidArgument when the time is negative or, for GPS, outside the years 2000-2255
std::array<std::uint8_t, 8> encode_timestamp(std::uint8_t timestamp_type, std::int64_t time_ns);

/// Times of the packets of one device, made continuous where the sensor counts from the last PPS
/// edge.
class PacketClock {
 public:
  /// Time of the packet's first shot, ns; UTC since 1970. Empty when its bytes are no time.
  std::optional<std::int64_t> time_ns(const Packet& packet);

  /// New seconds seen in PPS times.
  std::uint64_t wraps() const { return wraps_; }

 private:
  std::int64_t pps_time(std::int64_t since_edge_ns);

  std::int64_t second_ns_ = 0;  // time of the last PPS edge
  std::int64_t last_since_edge_ns_ = 0;
  std::uint64_t wraps_ = 0;
};

/// Decodes all records of a point packet into rows [first_row, first_row + layout.rows()), which
/// must exist. A record without return keeps its row: range 0, valid 0.
/// @return number of the first record that no sensor can have sent (a return with an angle out of
///         range); the rows are then not to be used
std::optional<std::size_t> decode_records(const RecordLayout& layout, const std::uint8_t* bytes,
                                          std::int64_t time_ns, const ShotGrid& grid,
                                          std::uint8_t device, Observations& observations,
                                          std::size_t first_row);

/// Encodes one record from its layout.returns rows; times are not part of a record.
/// @param row_number  of the first row, for messages
/// @throws InvalidArgument when the record cannot hold a value
void encode_record(const RecordLayout& layout, const Observations& observations,
                   std::size_t first_row, std::uint64_t row_number, std::uint8_t* bytes);

/// Inertial sample <-> bytes [24].
ImuSample decode_imu(const std::uint8_t* bytes);
void encode_imu(const ImuSample& sample, std::uint8_t* bytes);

}  // namespace risley::recordings
