// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The data packet of Livox's second generation (Mid-360, HAP), as the sensors send it by UDP: a
// header of 36 bytes with a number, then any number of records. LVX 2 keeps the records and most of
// the header. All numbers are little-endian and packed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "risley/recordings/livox/packet.hpp"
#include "risley/recordings/livox/packet_decoder.hpp"
#include "risley/recordings/observations.hpp"

namespace risley::recordings::livox {

/// Bytes of the header in front of the records.
inline constexpr std::size_t kNumberedHeaderBytes = 36;
/// Packet::version of these packets.
inline constexpr std::uint8_t kNumberedVersion = 0;
/// Data types: inertial samples, and how points are stored.
inline constexpr std::uint8_t kNumberedImu = 0,  ///< one inertial sample
    kNumberedPoints = 1,                         ///< coordinates in mm
    kNumberedShortPoints = 2,                    ///< coordinates in cm
    kNumberedSpherical = 3,                      ///< range in mm, angles in 0.01 deg
    kNumberedTwoReturns = 0x11;                  ///< two returns of a shot, as kNumberedPoints
/// Intensity of a record without return outside the configured field of view.
inline constexpr std::uint8_t kOutsideViewIntensity = 60;

/// Fields before the records.
struct NumberedHeader {
  std::uint16_t interval = 0;  ///< first to last record, 0.1 us; 0 for inertial samples
  std::uint16_t records = 0;   ///< in the packet
  std::uint16_t number = 0;    ///< 65535 is followed by 0; points and inertial samples count apart
  std::uint8_t frame = 0, data_type = kNumberedPoints;
  std::uint8_t time_type = 0;  ///< 0 since power-on, 1 PTP, 2 GPS
  std::uint8_t safety = 0;     ///< bits 0-1: 0 trustworthy, 1 not, 2 only points that are not 0
  std::uint32_t checksum = 0;  ///< CRC-32 of time and records; 0 if the sensor computes none
  std::uint64_t time_ns = 0;   ///< of the first record
};

/// Layout of this many records of a data type; empty for other data types.
std::optional<RecordLayout> numbered_layout(std::uint8_t data_type, std::uint16_t records);

/// Shots of a device type; empty if the type does not imply them. @param device_type  Device::type
std::optional<ShotGrid> numbered_grid(std::uint8_t device_type);

/// Shots of a packet by its own interval; if it states none, those of the device type.
ShotGrid interval_grid(const NumberedHeader& header, std::uint8_t device_type);

/// Origin of the times of NumberedHeader::time_type.
TimeReference numbered_time_reference(std::uint8_t time_type);
/// The inverse of it.
std::uint8_t time_type_of(TimeReference reference);

/// CRC-32 of zlib: of a packet's time and records.
std::uint32_t packet_checksum(std::span<const std::uint8_t> bytes);

/// The header of a whole datagram. A checksum is not compared.
/// @throws BadPacket for another version, a length that is not that of the datagram, an unknown
///         data type, records that do not fit, and a time so late that its last shot does not fit
NumberedHeader decode_numbered_header(std::span<const std::uint8_t> bytes);

/// @param bytes  [kNumberedHeaderBytes + records], with the records already in place; length and
/// checksum are computed
void encode_numbered_header(const NumberedHeader& header, std::span<std::uint8_t> bytes);

/// The header as stored in chunks, without rows. @param device  Packet::device_index
Packet packet_of(const NumberedHeader& header, std::uint8_t device);
/// Time of the first record, ns. @param packet  of the second generation
std::int64_t numbered_time_ns(const Packet& packet);

/// Appends the rows of records of either kind of container to a chunk, or their inertial samples,
/// and for each packet one entry of Chunk::packets.
/// @param records  [whole records of the data type]
/// @param grid     of the shots
/// @param device   Observations::device and Packet::device_index
/// @throws BadPacket for angles beyond a turn of a return, and non-finite inertial values; the
/// place is counted from the first record. The chunk is then unchanged.
void decode_numbered_records(const NumberedHeader& header, std::span<const std::uint8_t> records,
                             const ShotGrid& grid, std::uint8_t device, Chunk& chunk);
/// The same for a chunk whose columns have room for the rows from a row on.
void decode_numbered_records_into(const NumberedHeader& header,
                                  std::span<const std::uint8_t> records, const ShotGrid& grid,
                                  std::uint8_t device, Chunk& chunk, std::size_t row);

/// Turns a datagram into rows: the times of its shots follow from its header.
/// @param device_type  which emitters fire in turn
/// @throws BadPacket as decode_numbered_header() and decode_numbered_records(); the chunk is then
/// unchanged
void decode_numbered_packet(std::span<const std::uint8_t> bytes, std::uint8_t device_type,
                            std::uint8_t device, Chunk& chunk);

/// Encodes one record of a data type of points from its rows.
/// @param row_number  of the first row, for messages
/// @param bytes       [bytes per record of the data type]
/// @throws InvalidArgument when the record cannot hold a value
void encode_numbered_record(std::uint8_t data_type, const Observations& observations,
                            std::size_t first_row, std::uint64_t row_number, std::uint8_t* bytes);

/// Meaning of a point's tag, in words. @param device_type  Device::type
std::string tag_words(std::uint8_t device_type, std::uint8_t tag);

/// Counts packets of one sensor and port by their numbers of 16 bits. If more than 32768 are
/// missing, the times of the packets determine how often the number wrapped.
class PacketNumbers {
 public:
  /// Number of earlier packets in which duplicates are recognised.
  static constexpr std::size_t kRemembered = 1024;

  /// Relation of a packet to the previous ones.
  enum class Kind : std::uint8_t {
    next,       ///< follows the newest one, possibly after a gap
    duplicate,  ///< one of the last kRemembered once more, with its number and time
    late,       ///< belongs before the newest one
    restarted,  ///< the sensor restarted: the number of missing packets is unknown
  };
  /// What a packet's number says.
  struct Place {
    Kind kind = Kind::next;
    std::int64_t index = 0;  ///< of the packet in a count without wrapping; grows with every
                             ///< restart
    std::uint64_t lost = 0;  ///< packets between the newest one and this
  };

  /// The next packet that came. @param paused  the sensor was away: if its time goes back, even by
  /// little, it restarted
  Place add(const Packet& packet, bool paused = false);

 private:
  /// Advances by this number of packets when only the last one arrived.
  Place advance(const Packet& packet, std::int64_t steps, Kind kind, std::uint64_t lost);

  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();

  std::vector<std::int64_t> times_ns_ = std::vector(kRemembered, kNever);  ///< by index
  std::optional<Packet> last_;                                             ///< the newest
  std::int64_t index_ = kRemembered;                                       ///< of it
  std::int64_t period_ns_ = 0;  ///< shortest time between neighbours so far; 0 when unknown
};

}  // namespace risley::recordings::livox
