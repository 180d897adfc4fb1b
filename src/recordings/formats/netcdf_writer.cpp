// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Equal recordings give equal bytes, however they are split into calls: blocks of rows and of
// packet headers go to the file in an order that depends only on their content.
#include <algorithm>
#include <map>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/tables/netcdf.hpp"

#include "recordings/formats/format.hpp"
#include "recordings/formats/netcdf_layout.hpp"

namespace risley::recordings::netcdf {
namespace {

using Variables = std::map<std::string_view, tables::NetcdfVariable>;
using Dimensions = std::map<std::string_view, tables::NetcdfDimension>;

/// Defines variables of one table, whose entries run along `dimension`.
/// @param block  entries per compressed block; 0 for a table of fixed length, kept in one piece
struct DefineColumns {
  tables::NetcdfOutput& file;
  Variables& variables;
  const Dimensions& inner;
  const tables::NetcdfDimension& dimension;
  std::size_t block;
  bool second_generation = false;

  template <class Values>
  void operator()(const NetcdfColumn& column, const Values&) const {
    using T = ElementOf<Values>;
    if (column.second_generation && !second_generation) return;
    const tables::NetcdfStorage storage{block, block > 0, block > 0};
    const auto variable =
        column.inner_dimension == nullptr
            ? file.define<T>(column.name, {&dimension}, storage)
            : file.define<T>(column.name, {&dimension, &inner.at(column.inner_dimension)}, storage);
    if (column.units != nullptr) file.put_text(variable, "units", column.units);
    file.put_text(variable, "long_name", column.long_name);
    variables.emplace(column.name, variable);
  }
};

/// Writes entries [offset, offset + count) of the given columns at entry `start` of the file.
struct PutColumns {
  tables::NetcdfOutput& file;
  const Variables& variables;
  std::size_t start, offset, count;

  template <class T>
  void operator()(const NetcdfColumn& column, const std::vector<T>& values) const {
    file.put(variables.at(column.name), start,
             std::span<const T>(values).subspan(offset * column.width, count * column.width));
  }
};

/// Writes records at entry `start` of the file.
template <class Record>
struct PutRecords {
  tables::NetcdfOutput& file;
  const Variables& variables;
  std::size_t start;
  std::span<const Record> records;

  template <class T>
  void operator()(const NetcdfColumn& column, T Record::*member) const {
    if (column.second_generation && !variables.contains(column.name)) return;
    std::vector<ElementOf<T>> values;
    for (const Record& record : records) {
      const T& value = record.*member;
      if constexpr (std::is_arithmetic_v<T>) {
        values.push_back(static_cast<ElementOf<T>>(value));
      } else {
        values.insert(values.end(), value.begin(), value.end());
        values.resize(values.size() + column.width - value.size());
      }
    }
    file.put(variables.at(column.name), start, values);
  }
};

std::size_t serial_length_of(const std::vector<Device>& devices) {
  std::size_t length = kShortestSerial;
  for (const Device& device : devices) {
    length =
        std::max({length, device.serial.size(), device.hub_serial.size(), device.address.size()});
  }
  return length;
}

class NetcdfWriter final : public Writer {
 public:
  NetcdfWriter(const std::string& path, const RecordingHeader& header) : file_(path) {
    if (header.devices.empty()) {
      throw InvalidArgument("RecordingHeader::devices is empty, expected at least one device");
    }
    write_header(header);
  }

  void append(const Chunk& chunk) override {
    require_whole_packets(chunk);
    rows_.append(chunk.observations);
    packets_.insert(packets_.end(), chunk.packets.begin(), chunk.packets.end());
    imu_.insert(imu_.end(), chunk.imu.begin(), chunk.imu.end());
    flush(false);
  }

  void close() override {
    flush(true);
    for (std::size_t start = 0; start < imu_.size(); start += kImuBlock) {
      const auto block =
          std::span<const ImuSample>(imu_).subspan(start, std::min(kImuBlock, imu_.size() - start));
      for_each_imu_column(PutRecords<ImuSample>{file_, variables_, start, block});
    }
    file_.close();
  }

 private:
  void write_header(const RecordingHeader& header) {
    file_.put_text("Conventions", "CF-1.9");
    file_.put_text("title", "Recording of a scanning lidar");
    file_.put_number(kMarker, kLayoutVersion);
    const bool unknown_source = header.format == kName && source_format(header) == kName;
    file_.put_text(kSourceFormat, unknown_source ? "" : source_format(header));
    file_.put_text("time_reference", to_string(header.time_reference));
    const auto put_number = [this](const char* name, std::uint32_t value) {
      file_.put_number(name, value);
    };
    put_number(kHasTimes, header.has_times ? 1 : 0);
    put_number("has_range", header.has_range ? 1 : 0);
    put_number("has_intensity", header.has_intensity ? 1 : 0);
    put_number("cartesian", header.cartesian ? 1 : 0);
    put_number("returns_per_shot", static_cast<std::uint32_t>(header.returns_per_shot));
    put_number("frame_duration_ms", header.frame_duration_ms);
    auto details = header.details;
    std::erase_if(details, [](const auto& detail) { return detail.first == kSourceFormat; });
    file_.put_text_group(kDetailsGroup, details);
    const std::size_t serial_length = serial_length_of(header.devices);
    Dimensions inner;
    for (const auto& [name, length] :
         {std::pair{kByteDimension, std::tuple_size_v<decltype(Packet::timestamp)>},
          std::pair{kAxisDimension, std::size_t{3}}, std::pair{kSerialDimension, serial_length}}) {
      inner.emplace(name, file_.define_dimension(name, length));
    }
    const auto device = file_.define_dimension(kDeviceDimension, header.devices.size());
    const auto row = file_.define_growing_dimension(kRowDimension);
    for_each_row_column(rows_, DefineColumns{file_, variables_, inner, row, kRowBlock});
    const auto packet = file_.define_growing_dimension(kPacketDimension);
    const bool second = std::any_of(
        header.devices.begin(), header.devices.end(),
        [](const Device& one) { return !one.address.empty() || is_second_generation(one.type); });
    for_each_packet_column(DefineColumns{file_, variables_, inner, packet, kPacketBlock, second});
    const auto sample = file_.define_growing_dimension(kImuDimension);
    for_each_imu_column(DefineColumns{file_, variables_, inner, sample, kImuBlock});
    for_each_device_column(serial_length,
                           DefineColumns{file_, variables_, inner, device, 0, second});
    file_.end_definitions();
    for_each_device_column(serial_length, PutRecords<Device>{file_, variables_, 0, header.devices});
  }

  /// Packets, if there are any, must account for all rows and inertial samples.
  void require_whole_packets(const Chunk& chunk) {
    if (chunk.observations.size() == 0 && chunk.imu.empty() && chunk.packets.empty()) return;
    if (!with_packets_) with_packets_ = !chunk.packets.empty();
    std::size_t rows = 0, samples = 0;
    for (const auto& packet : chunk.packets) {
      rows += packet.rows;
      if (packet.is_imu()) ++samples;
    }
    if (*with_packets_ ? rows == chunk.observations.size() && samples == chunk.imu.size()
                       : chunk.packets.empty()) {
      return;
    }
    throw InvalidArgument(fmt::format(
        "a chunk of {} rows and {} inertial samples has packets of {} rows and {} samples; "
        "expected the same, or no packets in the whole recording",
        chunk.observations.size(), chunk.imu.size(), rows, samples));
  }

  /// Writes the full blocks, and at the end the rest: those of rows and of packets in the order in
  /// which the recording completes them, rows first.
  void flush(bool at_end) {
    const auto block_of = [at_end](std::size_t available, std::size_t block) {
      return available >= block ? block : at_end ? available : 0;
    };
    std::size_t done = 0;
    while (true) {
      const std::size_t rows = block_of(rows_.size() - done, kRowBlock);
      const std::size_t packets = block_of(packets_.size(), kPacketBlock);
      std::uint64_t packets_end = rows_of_written_packets_;
      for (std::size_t i = 0; i < packets; ++i) packets_end += packets_[i].rows;
      if (rows > 0 && (packets == 0 || rows_written_ + rows <= packets_end)) {
        for_each_row_column(rows_, PutColumns{file_, variables_, rows_written_, done, rows});
        rows_written_ += rows;
        done += rows;
      } else if (packets > 0) {
        const auto block = std::span<const Packet>(packets_).first(packets);
        for_each_packet_column(PutRecords<Packet>{file_, variables_, packets_written_, block});
        packets_.erase(packets_.begin(), packets_.begin() + static_cast<std::ptrdiff_t>(packets));
        packets_written_ += packets;
        rows_of_written_packets_ = packets_end;
      } else {
        break;
      }
    }
    if (done == 0) return;
    for_each_row_column(rows_, [done](const NetcdfColumn&, auto& column) {
      column.erase(column.begin(), column.begin() + static_cast<std::ptrdiff_t>(done));
    });
  }

  tables::NetcdfOutput file_;
  Variables variables_;
  Observations rows_;
  std::vector<Packet> packets_;
  std::vector<ImuSample> imu_;  ///< to the end: there are 200 per second
  std::optional<bool> with_packets_;
  std::size_t rows_written_ = 0, packets_written_ = 0;
  std::uint64_t rows_of_written_packets_ = 0;
};

}  // namespace

std::unique_ptr<Writer> create_recording(const std::string& path, const RecordingHeader& header,
                                         const WriteOptions&) {
  return std::make_unique<NetcdfWriter>(path, header);
}

}  // namespace risley::recordings::netcdf
