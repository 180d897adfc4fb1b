// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/packet_decoder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/require.hpp"
#include "risley/core/saturating.hpp"
#include "risley/io/little_endian.hpp"

#include "recordings/formats/cartesian.hpp"
#include "recordings/livox/records.hpp"
#include "recordings/spherical_kernel.hpp"

namespace risley::recordings::livox {
namespace {

using io::load;

/// @return number of the first record that no sensor can have sent
std::optional<std::size_t> decode_spherical_records(const RecordLayout& layout,
                                                    const std::uint8_t* bytes, Observations& o,
                                                    std::size_t row) {
  static const auto& kernel = RISLEY_KERNEL_COPIES(decode_spherical).at(best_instruction_set());
  SphericalArguments a;
  a.records = layout.records;
  a.returns = layout.returns;
  a.tagged = layout.tagged;
  a.bytes = bytes;
  a.azimuth = o.azimuth.data() + row;
  a.zenith = o.zenith.data() + row;
  a.range = o.range.data() + row;
  a.azimuth_resolution = o.azimuth_resolution.data() + row;
  a.zenith_resolution = o.zenith_resolution.data() + row;
  a.range_resolution = o.range_resolution.data() + row;
  a.intensity = o.intensity.data() + row;
  a.tag = o.tag.data() + row;
  a.valid = o.valid.data() + row;
  const std::size_t sound = kernel(a);
  return sound < a.records ? std::optional(sound) : std::nullopt;
}

/// Records of three integers, an intensity and possibly a tag.
/// @param step  of the numbers, m
template <class Number, bool kTagged>
void decode_cartesian(std::size_t points, const std::uint8_t* bytes, double step, Observations& o,
                      std::size_t row) {
  constexpr std::size_t kCoordinates = 3 * sizeof(Number), kBytes = kCoordinates + 1 + kTagged;
  constexpr std::size_t kBlock = 128;  // all records of a packet
  double x[kBlock], y[kBlock], z[kBlock];
  for (const std::size_t end = row + points; row < end;) {
    const std::size_t count = std::min(kBlock, end - row);
    for (std::size_t i = 0; i < count; ++i, bytes += kBytes) {
      x[i] = load<Number>(bytes) * step;
      y[i] = load<Number>(bytes + sizeof(Number)) * step;
      z[i] = load<Number>(bytes + 2 * sizeof(Number)) * step;
      o.intensity[row + i] = bytes[kCoordinates];
      o.tag[row + i] = kTagged ? bytes[kCoordinates + 1] : 0;
    }
    set_cartesian(o, row, count, x, y, z, step);
    row += count;
  }
}

/// As data type 0, but in metres.
/// @return number of the first record that is not a point
std::optional<std::size_t> decode_float_points(std::size_t points, const std::uint8_t* bytes,
                                               Observations& o, std::size_t row) {
  for (std::size_t point = 0; point < points; ++point, ++row, bytes += 13) {
    const Vector3<double> position{load<float>(bytes), load<float>(bytes + 4),
                                   load<float>(bytes + 8)};
    if (!std::isfinite(position.x + position.y + position.z)) return point;
    set_cartesian(o, row, position, kMillimetre);
    o.intensity[row] = bytes[12];
    o.tag[row] = 0;
  }
  return std::nullopt;
}

void check_grid(const ShotGrid& grid) {
  require_at_least("ShotGrid::interval_denominator", grid.interval_denominator, 1);
  require_at_least("ShotGrid::beams", grid.beams, 1);
  require_at_least("ShotGrid::records_per_shot", grid.records_per_shot, 1);
}

void check_layout(const RecordLayout& layout) {
  const std::size_t returns = layout.returns;
  std::size_t bytes = 4 + 6 * returns;
  if (layout.cartesian) {
    bytes = returns * (layout.tagged ? 14 : 13);
  } else if (returns == 1) {
    bytes = layout.tagged ? 10 : 9;
  }
  const bool is_known = returns >= 1 && returns <= 3 && (layout.tagged || returns == 1);
  if (is_known && layout.bytes_per_record == bytes) return;
  throw InvalidArgument(
      fmt::format("a layout of {} {} returns and {} bytes per record, allowed those of the data "
                  "types 0 to 5, 7 "
                  "and 8",
                  layout.returns, layout.tagged ? "tagged" : "untagged", layout.bytes_per_record));
}

void require_bytes(std::size_t found, std::size_t expected, const char* what) {
  if (found == expected) return;
  throw BadPacket(std::min(found, expected),
                  fmt::format("expected {} bytes of {}, found {}", expected, what, found));
}

/// Rows of one shot are consecutive, whether one record holds them or several.
void set_shots(const RecordLayout& layout, std::int64_t time_ns, const ShotGrid& grid,
               std::uint8_t device, Observations& o, std::size_t first_row) {
  const auto at = [first_row](auto& column) {
    return column.begin() + static_cast<std::ptrdiff_t>(first_row);
  };
  std::fill_n(at(o.device), layout.rows(), device);
  const std::uint32_t rows_per_shot = std::uint32_t{layout.returns} * grid.records_per_shot;
  if (rows_per_shot == 1 && grid.interval_denominator == 1) {
    const std::int64_t step = grid.interval_numerator_ns;
    const std::int64_t last = saturating_sum(time_ns, std::int64_t{layout.records} * step);
    if (last < std::numeric_limits<std::int64_t>::max()) {
      std::int64_t shot_time = time_ns;
      for (std::size_t row = first_row, end = first_row + layout.rows(); row < end; ++row) {
        o.time_ns[row] = shot_time;
        shot_time += step;
      }
      // The first period by counting, then copies of the existing part, doubling each time.
      std::uint8_t* const beams = o.beam.data() + first_row;
      std::size_t known = std::min<std::size_t>(grid.beams, layout.rows());
      std::iota(beams, beams + known, std::uint8_t{0});
      for (; known < layout.rows(); known *= 2) {
        std::copy_n(beams, std::min(known, layout.rows() - known), beams + known);
      }
      std::fill_n(at(o.return_number), layout.rows(), std::uint8_t{1});
      return;
    }
  }
  std::uint32_t shot = 0;
  for (std::size_t row = first_row, end = first_row + layout.rows(); row < end; ++shot) {
    const std::int64_t shot_time = saturating_sum(time_ns, grid.offset_ns(shot));
    const auto beam = static_cast<std::uint8_t>(grid.beams == 1 ? 0 : shot % grid.beams);
    for (std::uint32_t number = 1; number <= rows_per_shot && row < end; ++number, ++row) {
      o.time_ns[row] = shot_time;
      o.beam[row] = beam;
      o.return_number[row] = static_cast<std::uint8_t>(number);
    }
  }
}

/// @return number of the first record that no sensor can have sent
std::optional<std::size_t> decode_points(const RecordLayout& layout, const std::uint8_t* bytes,
                                         Observations& o, std::size_t first_row) {
  if (layout.cartesian) {
    if (layout.tagged) {
      decode_cartesian<std::int32_t, true>(layout.rows(), bytes, kMillimetre, o, first_row);
    } else {
      decode_cartesian<std::int32_t, false>(layout.rows(), bytes, kMillimetre, o, first_row);
    }
    return std::nullopt;
  }
  return decode_spherical_records(layout, bytes, o, first_row);
}

/// Gives columns room for more rows while a function fills them; reverts it if that throws.
template <class Function>
void with_more_rows(Observations& rows, std::size_t more, Function&& fill) {
  const std::size_t before = rows.size();
  rows.resize(before + more);
  try {
    fill(before);
  } catch (...) {
    rows.resize(before);
    throw;
  }
}

/// Runs a function on the data after the header, with places counted from the records on.
template <class Function>
void behind_header(Function&& function) {
  try {
    function();
  } catch (const BadPacket& bad) {
    throw BadPacket(kPacketHeaderBytes + bad.byte_offset(), bad.problem());
  }
}

}  // namespace

void put_records(const RecordLayout& layout, const std::uint8_t* bytes, Coordinates coordinates,
                 std::int64_t time_ns, const ShotGrid& grid, std::uint8_t device,
                 Observations& rows, std::size_t first_row) {
  std::optional<std::size_t> impossible;
  switch (coordinates) {
    case Coordinates::millimetres:
      impossible = decode_points(layout, bytes, rows, first_row);
      break;
    case Coordinates::metres:
      impossible = decode_float_points(layout.records, bytes, rows, first_row);
      break;
    case Coordinates::centimetres:
      decode_cartesian<std::int16_t, true>(layout.records, bytes, kCentimetre, rows, first_row);
      break;
  }
  if (impossible) {
    throw BadPacket(*impossible * layout.bytes_per_record,
                    coordinates == Coordinates::metres
                        ? "a point has a coordinate that is not a finite number"
                        : "a return has an angle outside zenith [0, 18000] or azimuth "
                          "[0, 36000] x 0.01 deg");
  }
  set_shots(layout, time_ns, grid, device, rows, first_row);
}

BadPacket::BadPacket(std::size_t byte_offset, std::string problem)
    : Error(fmt::format("byte {} of a packet: {}", byte_offset, problem)),
      byte_offset_(byte_offset),
      problem_(std::move(problem)) {}

PacketDecoder::PacketDecoder(const PacketDecoderOptions& options) : options_(options) {
  if (options_.grid) check_grid(*options_.grid);
}

void PacketDecoder::decode(std::span<const std::uint8_t> bytes, Chunk& chunk) {
  const std::size_t rows = chunk.observations.size();
  const RecordLayout* layout =
      bytes.size() > kDataTypeAt ? record_layout(bytes[kDataTypeAt]) : nullptr;
  with_more_rows(chunk.observations, layout == nullptr ? 0 : layout->rows(),
                 [&](std::size_t) { decode_into(bytes, chunk, rows); });
}

void PacketDecoder::decode_into(std::span<const std::uint8_t> bytes, Chunk& chunk,
                                std::size_t row) {
  Packet packet = decode_packet_header(bytes);
  if (options_.float_points ? packet.version == 0 : packet.version != kPacketVersion) {
    throw BadPacket(kVersionAt, fmt::format("packet version = {}, expected {}", packet.version,
                                            kPacketVersion));
  }
  const RecordLayout* layout = record_layout(packet.data_type);
  if (layout == nullptr || (options_.float_points && packet.data_type != 0)) {
    throw BadPacket(kDataTypeAt, fmt::format("data type = {}, expected {}", packet.data_type,
                                             options_.float_points ? "0" : "0 to 8"));
  }
  const auto records = bytes.subspan(kPacketHeaderBytes);
  behind_header([&] { require_bytes(records.size(), layout->bytes(), "records"); });
  PacketClock clock = clock_;
  const std::optional<std::int64_t> time_ns = clock.time_ns(packet);
  if (!time_ns) {
    throw BadPacket(kTimestampTypeAt,
                    fmt::format("the bytes {:02X} are not a time stamp of type {}",
                                fmt::join(packet.timestamp, " "), packet.timestamp_type));
  }
  packet.rows = static_cast<std::uint32_t>(layout->rows());
  packet.device_index = options_.device;
  if (packet.data_type == kImuDataType) {
    behind_header([&] { chunk.imu.push_back(decode_imu(records)); });
    chunk.imu.back().time_ns = *time_ns;
    chunk.imu.back().device = options_.device;
  } else {
    const std::optional<ShotGrid> grid =
        options_.grid ? options_.grid : shot_grid(options_.device_type, packet.data_type);
    if (!grid) {
      throw InvalidArgument(
          fmt::format("device type = {}, whose shot rate with data type {} is unknown; allowed 1, "
                      "2, 3, 6 and 7, or any with PacketDecoderOptions::grid",
                      options_.device_type, packet.data_type));
    }
    behind_header([&] {
      require_rows("rows", row, row + layout->rows(), chunk.observations.size());
      put_records(*layout, records.data(),
                  options_.float_points ? Coordinates::metres : Coordinates::millimetres, *time_ns,
                  *grid, options_.device, chunk.observations, row);
    });
  }
  chunk.packets.push_back(packet);
  clock_ = clock;
}

Packet decode_packet_header(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kPacketHeaderBytes) {
    throw BadPacket(bytes.size(), fmt::format("expected a packet header of {} bytes, found {}",
                                              kPacketHeaderBytes, bytes.size()));
  }
  Packet packet;
  packet.version = bytes[kVersionAt];
  packet.slot = bytes[1];
  packet.lidar_id = bytes[2];
  packet.reserved = bytes[3];
  packet.status = load<std::uint32_t>(bytes.data() + 4);
  packet.timestamp_type = bytes[kTimestampTypeAt];
  packet.data_type = bytes[kDataTypeAt];
  std::copy_n(bytes.begin() + kTimestampAt, packet.timestamp.size(), packet.timestamp.begin());
  return packet;
}

void decode_records(const RecordLayout& layout, std::span<const std::uint8_t> bytes,
                    std::int64_t time_ns, const ShotGrid& grid, std::uint8_t device,
                    Observations& rows) {
  check_layout(layout);
  check_grid(grid);
  require_bytes(bytes.size(), layout.bytes(), "records");
  with_more_rows(rows, layout.rows(), [&](std::size_t first_row) {
    put_records(layout, bytes.data(), Coordinates::millimetres, time_ns, grid, device, rows,
                first_row);
  });
}

ImuSample decode_imu(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kValues = 6;
  require_bytes(bytes.size(), kValues * sizeof(float), "an inertial sample");
  ImuSample sample;
  for (std::size_t i = 0; i < kValues; ++i) {
    const auto value = load<float>(bytes.data() + i * sizeof(float));
    if (!std::isfinite(value)) {
      throw BadPacket(i * sizeof(float), fmt::format("expected a finite number, found {}", value));
    }
    (i < 3 ? sample.angular_velocity[i] : sample.acceleration_g[i - 3]) = value;
  }
  return sample;
}

}  // namespace risley::recordings::livox
