// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "risley/core/error.hpp"
#include "risley/recordings/livox/packet.hpp"
#include "risley/recordings/observations.hpp"

namespace risley::recordings::livox {

/// Bytes that no sensor sends.
class BadPacket : public Error {
 public:
  /// @param byte_offset  of the error, from the first byte given
  /// @param problem      what was expected and what was found
  BadPacket(std::size_t byte_offset, std::string problem);

  /// Of the error, from the first byte given.
  std::size_t byte_offset() const { return byte_offset_; }
  /// What was expected and what was found.
  const std::string& problem() const { return problem_; }

 private:
  std::size_t byte_offset_;
  std::string problem_;
};

/// Properties of the sensor that are not in its packets.
struct PacketDecoderOptions {
  std::uint8_t device_type = kMid40;  ///< as Device::type
  std::uint8_t device = 0;            ///< Observations::device of all rows
  /// Replaces the values implied by device type and data type: for special firmware and unknown
  /// devices.
  std::optional<ShotGrid> grid = {};
  /// As LVX 1.0 keeps packets: any version but 0, and data type 0 in metres as floats.
  bool float_points = false;
};

/// Turns the packets of one sensor into rows, one by one as they come, without looking ahead. Its
/// only state between packets is the clock.
class PacketDecoder {
 public:
  /// @throws InvalidArgument for a grid whose interval_denominator, beams or records_per_shot is 0
  explicit PacketDecoder(const PacketDecoderOptions& options);

  /// Appends the rows of a packet, or its inertial sample, and its header to a chunk. Memory is
  /// allocated only if the chunk's columns have to grow. Records without a return are rows with
  /// range 0, valid 0.
  /// @param bytes  header and all records, nothing after them
  /// @throws BadPacket for a wrong length, version, data type or time, for angles beyond a turn of
  /// a return, for non-finite coordinates and inertial values; InvalidArgument if neither types nor
  /// options determine the grid. Chunk and clock are then unchanged.
  void decode(std::span<const std::uint8_t> bytes, Chunk& chunk);
  /// The same for a chunk filled by many packets: rows are written from a given row on where the
  /// columns already have room, so that no column grows packet by packet.
  void decode_into(std::span<const std::uint8_t> bytes, Chunk& chunk, std::size_t row);

  /// New seconds seen in PPS times.
  std::uint64_t clock_wraps() const { return clock_.wraps(); }

 private:
  PacketDecoderOptions options_;
  PacketClock clock_;
};

/// The fields of a packet header. rows, frame and device_index are not in it.
/// @param bytes  [at least kPacketHeaderBytes] @throws BadPacket when there are fewer
Packet decode_packet_header(std::span<const std::uint8_t> bytes);

/// Appends the rows of records without a packet header.
/// @param layout   of a data type with points, any number of records
/// @param bytes    [layout.bytes()]
/// @param time_ns  of the first shot
/// @param device   Observations::device
/// @throws BadPacket for a wrong length and for a return with angles beyond a turn; no row is then
///         appended
void decode_records(const RecordLayout& layout, std::span<const std::uint8_t> bytes,
                    std::int64_t time_ns, const ShotGrid& grid, std::uint8_t device,
                    Observations& rows);

/// The inertial sample of data type 6; its time and device are stored elsewhere.
/// @param bytes  [24] @throws BadPacket for another length and non-finite values
ImuSample decode_imu(std::span<const std::uint8_t> bytes);

}  // namespace risley::recordings::livox
