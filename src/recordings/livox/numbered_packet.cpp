// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/numbered_packet.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <zlib.h>

#include "risley/core/error.hpp"
#include "risley/core/saturating.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/recordings/livox/packet_encoder.hpp"

#include "recordings/livox/records.hpp"

namespace risley::recordings::livox {
namespace {

using io::load;
using io::store;

constexpr std::size_t kPacketLengthAt = 1, kIntervalAt = 3, kRecordsAt = 5, kNumberAt = 7,
                      kFrameAt = 9, kTypeAt = 10, kTimeTypeAt = 11, kSafetyAt = 12,
                      kChecksumAt = 24, kTimeAt = 28;
constexpr std::uint16_t kShortBytes = 8;
constexpr std::int64_t kIntervalUnit_ns = 100;
/// A packet's last shot is later than its first: room for it is reserved.
constexpr auto kLatestNumbered =
    static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max() - 3'600'000'000'000);

/// Emitters that fire in turn.
std::uint8_t emitters_of(std::uint8_t device_type) {
  const auto grid = numbered_grid(device_type);
  return grid ? grid->beams : std::uint8_t{1};
}

}  // namespace

std::optional<RecordLayout> numbered_layout(std::uint8_t data_type, std::uint16_t records) {
  constexpr std::uint8_t kImuBytes = 24, kPointBytes = 14, kSphericalBytes = 10;
  switch (data_type) {
    case kNumberedImu:
      return RecordLayout{false, false, 0, records, kImuBytes};
    case kNumberedPoints:
      return RecordLayout{true, true, 1, records, kPointBytes};
    case kNumberedShortPoints:
      return RecordLayout{true, true, 1, records, kShortBytes};
    case kNumberedSpherical:
      return RecordLayout{false, true, 1, records, kSphericalBytes};
    case kNumberedTwoReturns:
      return RecordLayout{true, true, 2, records, 2 * kPointBytes};
    default:
      return std::nullopt;
  }
}

std::optional<ShotGrid> numbered_grid(std::uint8_t device_type) {
  switch (device_type) {
    case kMid360:
    case kMid360s:
      return ShotGrid{5000, 1, 4, 1};
    case kHap:
    case kHapT1:
      return ShotGrid{250'000, 113, 6, 1};  // 452 kHz
    default:
      return std::nullopt;
  }
}

TimeReference numbered_time_reference(std::uint8_t time_type) {
  if (time_type == 1) return TimeReference::ptp;
  return time_type == 2 ? TimeReference::utc : TimeReference::power_on;
}

std::uint8_t time_type_of(TimeReference reference) {
  if (reference == TimeReference::ptp) return 1;
  return reference == TimeReference::utc ? 2 : 0;
}

std::uint32_t packet_checksum(std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint32_t>(crc32(0, bytes.data(), static_cast<uInt>(bytes.size())));
}

NumberedHeader decode_numbered_header(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kNumberedHeaderBytes) {
    throw BadPacket(bytes.size(), fmt::format("expected a packet header of {} bytes, found {}",
                                              kNumberedHeaderBytes, bytes.size()));
  }
  if (bytes[0] != kNumberedVersion) {
    throw BadPacket(0, fmt::format("packet version = {}, expected {}", bytes[0], kNumberedVersion));
  }
  const std::uint8_t* at = bytes.data();
  if (const auto length = load<std::uint16_t>(at + kPacketLengthAt); length != bytes.size()) {
    throw BadPacket(kPacketLengthAt,
                    fmt::format("length = {}, expected {} bytes", length, bytes.size()));
  }
  NumberedHeader header;
  header.interval = load<std::uint16_t>(at + kIntervalAt);
  header.records = load<std::uint16_t>(at + kRecordsAt);
  header.number = load<std::uint16_t>(at + kNumberAt);
  header.frame = at[kFrameAt];
  header.data_type = at[kTypeAt];
  header.time_type = at[kTimeTypeAt];
  header.safety = at[kSafetyAt];
  header.checksum = load<std::uint32_t>(at + kChecksumAt);
  header.time_ns = load<std::uint64_t>(at + kTimeAt);
  const auto layout = numbered_layout(header.data_type, header.records);
  if (!layout) {
    throw BadPacket(kTypeAt,
                    fmt::format("data type = {}, expected 0 to 3 or 17", header.data_type));
  }
  if (layout->bytes() > bytes.size() - kNumberedHeaderBytes) {
    throw BadPacket(kRecordsAt, fmt::format("{} records take {} bytes, found {}", header.records,
                                            layout->bytes(), bytes.size() - kNumberedHeaderBytes));
  }
  if (header.time_ns > kLatestNumbered) {
    throw BadPacket(kTimeAt, fmt::format("{} ns is not a time", header.time_ns));
  }
  return header;
}

void encode_numbered_header(const NumberedHeader& header, std::span<std::uint8_t> bytes) {
  std::uint8_t* at = bytes.data();
  std::fill_n(at, kNumberedHeaderBytes, std::uint8_t{0});
  store<std::uint16_t>(at + kPacketLengthAt, static_cast<std::uint16_t>(bytes.size()));
  store<std::uint16_t>(at + kIntervalAt, header.interval);
  store<std::uint16_t>(at + kRecordsAt, header.records);
  store<std::uint16_t>(at + kNumberAt, header.number);
  at[kFrameAt] = header.frame;
  at[kTypeAt] = header.data_type;
  at[kTimeTypeAt] = header.time_type;
  at[kSafetyAt] = header.safety;
  store<std::uint64_t>(at + kTimeAt, header.time_ns);
  store<std::uint32_t>(at + kChecksumAt, packet_checksum(bytes.subspan(kTimeAt)));
}

Packet packet_of(const NumberedHeader& header, std::uint8_t device) {
  Packet packet;
  packet.version = kNumberedVersion;
  packet.slot = packet.lidar_id = 0;
  packet.number = header.number;
  packet.reserved = header.frame;
  packet.device_index = device;
  packet.timestamp_type = header.time_type;
  packet.data_type = header.data_type;
  store<std::uint64_t>(packet.timestamp.data(), header.time_ns);
  return packet;
}

std::int64_t numbered_time_ns(const Packet& packet) {
  return static_cast<std::int64_t>(load<std::uint64_t>(packet.timestamp.data()));
}

void decode_numbered_records(const NumberedHeader& header, std::span<const std::uint8_t> records,
                             const ShotGrid& grid, std::uint8_t device, Chunk& chunk) {
  const std::size_t row = chunk.observations.size();
  chunk.observations.resize(row + numbered_layout(header.data_type, header.records)->rows());
  try {
    decode_numbered_records_into(header, records, grid, device, chunk, row);
  } catch (...) {
    chunk.observations.resize(row);
    throw;
  }
}

void decode_numbered_records_into(const NumberedHeader& header,
                                  std::span<const std::uint8_t> records, const ShotGrid& grid,
                                  std::uint8_t device, Chunk& chunk, std::size_t row) {
  const RecordLayout layout = *numbered_layout(header.data_type, header.records);
  const auto time_ns = static_cast<std::int64_t>(header.time_ns);
  Packet packet = packet_of(header, device);
  if (header.data_type != kNumberedImu) {
    if (header.records == 0) return;
    put_records(layout, records.data(),
                header.data_type == kNumberedShortPoints ? Coordinates::centimetres
                                                         : Coordinates::millimetres,
                time_ns, grid, device, chunk.observations, row);
    packet.rows = static_cast<std::uint32_t>(layout.rows());
    chunk.packets.push_back(packet);
    return;
  }
  std::vector<ImuSample> samples;
  for (std::size_t i = 0; i < header.records; ++i) {
    const std::size_t at = i * layout.bytes_per_record;
    try {
      samples.push_back(decode_imu(records.subspan(at, layout.bytes_per_record)));
    } catch (const BadPacket& bad) {
      throw BadPacket(at + bad.byte_offset(), bad.problem());
    }
    samples.back().time_ns = time_ns;
    samples.back().device = device;
  }
  chunk.imu.insert(chunk.imu.end(), samples.begin(), samples.end());
  chunk.packets.insert(chunk.packets.end(), samples.size(), packet);
}

void decode_numbered_packet(std::span<const std::uint8_t> bytes, std::uint8_t device_type,
                            std::uint8_t device, Chunk& chunk) {
  const NumberedHeader header = decode_numbered_header(bytes);
  const std::size_t size = numbered_layout(header.data_type, header.records)->bytes();
  try {
    decode_numbered_records(header, bytes.subspan(kNumberedHeaderBytes, size),
                            interval_grid(header, device_type), device, chunk);
  } catch (const BadPacket& bad) {
    throw BadPacket(kNumberedHeaderBytes + bad.byte_offset(), bad.problem());
  }
}

ShotGrid interval_grid(const NumberedHeader& header, std::uint8_t device_type) {
  if (header.interval == 0 && header.records > 1) {
    if (const auto usual = numbered_grid(device_type)) return *usual;
  }
  ShotGrid grid;
  grid.beams = emitters_of(device_type);
  grid.interval_numerator_ns = static_cast<std::uint32_t>(header.interval * kIntervalUnit_ns);
  grid.interval_denominator = std::max<std::uint32_t>(header.records, 2) - 1;
  if (grid.interval_numerator_ns % grid.interval_denominator == 0) {  // the quick way
    grid.interval_numerator_ns /= grid.interval_denominator;
    grid.interval_denominator = 1;
  }
  return grid;
}

void encode_numbered_record(std::uint8_t data_type, const Observations& observations,
                            std::size_t first_row, std::uint64_t row_number, std::uint8_t* bytes) {
  const RecordLayout layout = *numbered_layout(data_type, 1);
  if (data_type != kNumberedShortPoints) {
    encode_record(layout, observations, first_row, row_number, bytes);
    return;
  }
  std::array<std::uint8_t, 14> whole{};
  encode_record(*numbered_layout(kNumberedPoints, 1), observations, first_row, row_number,
                whole.data());
  bool any = false, some = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto millimetres = load<std::int32_t>(&whole[4 * axis]);
    const long centimetres = std::lround(millimetres / 10.0);
    if (std::abs(centimetres) > std::numeric_limits<std::int16_t>::max()) {
      throw InvalidArgument(
          fmt::format("row {}: range = {} m, allowed coordinates of up to 327.67 m in data type 2",
                      row_number, observations.range[first_row]));
    }
    any = any || millimetres != 0;
    some = some || centimetres != 0;
    store<std::int16_t>(bytes + 2 * axis, static_cast<std::int16_t>(centimetres));
  }
  if (any && !some) {
    throw InvalidArgument(
        fmt::format("row {}: range = {} m, allowed 0 for no return or at least one coordinate of "
                    "0.005 m in data type 2",
                    row_number, observations.range[first_row]));
  }
  bytes[6] = whole[12];
  bytes[7] = whole[13];
}

std::string tag_words(std::uint8_t device_type, std::uint8_t tag) {
  if (tag == 0) return "a good point";
  // Manuals and firmwares of the HAP differ in the other bits.
  if (device_type == kHap || device_type == kHapT1) return "perhaps no good point";
  struct Field {
    unsigned at;
    const char* doubt;
  };
  constexpr Field kFields[] = {{0, "between near objects"}, {2, "rain, fog or dust"}, {4, "other"}};
  std::string words;
  for (const Field& field : kFields) {
    const unsigned value = tag >> field.at & 3U;
    if (value == 0) continue;
    constexpr const char* kConfidence[] = {"", "medium", "low", "unknown"};
    words += fmt::format("{}{} confidence ({})", words.empty() ? "" : ", ", kConfidence[value],
                         field.doubt);
  }
  return words.empty() ? "a good point" : words;
}

PacketNumbers::Place PacketNumbers::advance(const Packet& packet, std::int64_t steps, Kind kind,
                                            std::uint64_t lost) {
  constexpr auto kMost = static_cast<std::int64_t>(kRemembered);
  for (std::int64_t i = 1; i <= std::min(steps, kMost); ++i) {
    times_ns_[static_cast<std::size_t>(saturating_sum(index_, i)) % kRemembered] = kNever;
  }
  index_ = saturating_sum(index_, steps);
  times_ns_[static_cast<std::size_t>(index_) % kRemembered] = numbered_time_ns(packet);
  last_ = packet;
  return {kind, index_, lost};
}

PacketNumbers::Place PacketNumbers::add(const Packet& packet, bool paused) {
  constexpr std::int64_t kRound = 65536, kFarBack = 1'000'000'000;  // numbers; ns
  if (!last_) return advance(packet, 1, Kind::next, 0);
  const std::int64_t passed =
      saturating_difference(numbered_time_ns(packet), numbered_time_ns(*last_));
  const bool same_clock = packet.timestamp_type == last_->timestamp_type;
  // With room for those that this one has overtaken.
  const auto restart = [&] { return advance(packet, kRemembered, Kind::restarted, 0); };
  if (same_clock && passed < (paused ? 0 : -kFarBack)) return restart();
  // Numbers that restart with every frame.
  if (packet.reserved != last_->reserved && packet.number < last_->number) {
    return advance(packet, std::int64_t{packet.number} + 1, Kind::next, packet.number);
  }
  const std::int64_t ahead = (std::int64_t{packet.number} - last_->number) & (kRound - 1);
  if (same_clock && ahead == 1 && passed > 0 && (period_ns_ == 0 || passed < period_ns_)) {
    period_ns_ = passed;
  }
  // Of the possible numbers, the one nearest to the times, unless a clock was set.
  constexpr double kLongestGap = 1e12;  // packets, 15 years
  const double by_time = same_clock && period_ns_ > 0
                             ? static_cast<double>(passed) / static_cast<double>(period_ns_)
                             : 0.0;
  std::int64_t steps = ahead;
  if (by_time < kLongestGap) {
    steps += kRound * std::llround((by_time - static_cast<double>(ahead)) / kRound);
  }
  if (steps == 0 && passed != 0) steps = 1;  // a writer that numbers no packets
  if (steps > 0) return advance(packet, steps, Kind::next, static_cast<std::uint64_t>(steps - 1));
  const std::int64_t index = index_ + steps;
  const bool known = -steps < static_cast<std::int64_t>(kRemembered);
  const std::size_t place =
      static_cast<std::size_t>(std::max<std::int64_t>(index, 0)) % kRemembered;
  if (!known || index <= 0) return {Kind::late, index, 0};
  const std::int64_t time_ns = numbered_time_ns(packet);
  if (times_ns_[place] == time_ns) return {Kind::duplicate, index, 0};
  if (times_ns_[place] != kNever) return restart();  // it gives a number again
  times_ns_[place] = time_ns;
  return {Kind::late, index, 0};
}

}  // namespace risley::recordings::livox
