// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <limits>
#include <map>
#include <optional>
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

/// The largest number that the columns of rows can express.
constexpr std::size_t kMostDevices = std::size_t{std::numeric_limits<std::uint8_t>::max()} + 1;
constexpr std::uint32_t kMostReturns = std::numeric_limits<std::uint8_t>::max();

/// Finds the variables of one table, and rejects a file whose variables have another layout.
struct RequireColumns {
  const tables::NetcdfInput& file;
  Variables& variables;
  const tables::NetcdfDimension& dimension;
  std::size_t block;  ///< entries that are read together

  template <class Values>
  void operator()(const NetcdfColumn& column, const Values&) const {
    using T = ElementOf<Values>;
    if (column.second_generation && !file.has_variable(column.name)) return;
    if (column.inner_dimension == nullptr) {
      variables.emplace(column.name, file.variable<T>(column.name, {&dimension}, block));
    } else {
      const auto inner = file.dimension(column.inner_dimension, column.width);
      variables.emplace(column.name, file.variable<T>(column.name, {&dimension, &inner}, block));
    }
  }
};

/// Reads entries [start, start + count) into the columns.
struct GetColumns {
  const tables::NetcdfInput& file;
  const Variables& variables;
  std::size_t start, count;

  template <class T>
  void operator()(const NetcdfColumn& column, std::vector<T>& values) const {
    file.get(variables.at(column.name), start, count, values);
  }
};

/// Reads records from entry `start` on, as many as exist.
template <class Record>
struct GetRecords {
  const tables::NetcdfInput& file;
  const Variables& variables;
  std::size_t start;
  std::vector<Record>& records;

  template <class T>
  void operator()(const NetcdfColumn& column, T Record::*member) const {
    if (column.second_generation && !variables.contains(column.name)) return;
    std::vector<ElementOf<T>> values;
    file.get(variables.at(column.name), start, records.size(), values);
    for (auto from = values.begin(); Record & record : records) {
      const auto end = from + static_cast<std::ptrdiff_t>(column.width);
      if constexpr (std::is_arithmetic_v<T>) {
        record.*member = static_cast<T>(*from);
      } else if constexpr (std::is_same_v<T, std::string>) {
        const std::string padded(from, end);
        record.*member = padded.substr(0, padded.find_last_not_of('\0') + 1);
      } else {
        std::copy(from, end, (record.*member).begin());
      }
      from = end;
    }
  }
};

class NetcdfReader final : public Reader {
 public:
  explicit NetcdfReader(std::shared_ptr<const tables::NetcdfInput> input)
      : input_(std::move(input)), file_(*input_) {
    read_header();
    const auto row = file_.dimension(kRowDimension);
    const auto packet = file_.dimension(kPacketDimension);
    const auto sample = file_.dimension(kImuDimension);
    row_count_ = row.length;
    packet_count_ = packet.length;
    imu_count_ = sample.length;
    for_each_row_column(Observations{}, RequireColumns{file_, variables_, row, kRowBlock});
    for_each_packet_column(RequireColumns{file_, variables_, packet, kPacketBlock});
    for_each_imu_column(RequireColumns{file_, variables_, sample, kImuBlock});
  }

  bool read(Chunk& chunk, std::size_t max_rows) override {
    chunk.clear();
    if (pending_) throw FileError(*pending_);
    try {
      std::size_t rows = std::min(max_rows, row_count_ - row_);
      std::size_t samples = std::min(max_rows, imu_count_ - imu_sample_);
      if (packet_count_ > 0) take_packets(chunk.packets, max_rows, rows, samples);
      read_rows(chunk.observations, rows);
      read_imu(chunk.imu, samples);
    } catch (const FileError& error) {
      pending_.emplace(error);
      keep_whole_packets(chunk);
    }
    row_ += chunk.observations.size();
    imu_sample_ += chunk.imu.size();
    const bool some = chunk.observations.size() > 0 || !chunk.packets.empty() || !chunk.imu.empty();
    if (!some && pending_) throw FileError(*pending_);
    return some;
  }

  std::unique_ptr<Reader> again() const override { return std::make_unique<NetcdfReader>(input_); }

  double fraction_read() const override {
    const std::size_t total = row_count_ + imu_count_;
    return total == 0 ? 1.0 : static_cast<double>(row_ + imu_sample_) / static_cast<double>(total);
  }

 private:
  void read_header() {
    if (!file_.has_attribute(kMarker)) {
      file_.fail(fmt::format(
          "is a NetCDF file, but not a recording of risley: its global attribute {} is missing",
          kMarker));
    }
    if (const auto version = file_.number(kMarker); version != kLayoutVersion) {
      file_.fail(fmt::format("expected {} = {}, found {}", kMarker, kLayoutVersion, version));
    }
    header_.format = kName;
    header_.time_reference = read_time_reference();
    // Files of earlier versions have times and do not state it.
    if (file_.has_attribute(kHasTimes)) header_.has_times = file_.number(kHasTimes) != 0;
    header_.has_range = file_.number("has_range") != 0;
    header_.has_intensity = file_.number("has_intensity") != 0;
    header_.cartesian = file_.number("cartesian") != 0;
    const std::uint32_t returns = file_.number("returns_per_shot");
    if (returns < 1 || returns > kMostReturns) {
      file_.fail(fmt::format("returns_per_shot = {}, allowed 1 to {}", returns, kMostReturns));
    }
    header_.returns_per_shot = static_cast<int>(returns);
    header_.frame_duration_ms = file_.number("frame_duration_ms");
    header_.details = file_.text_group(kDetailsGroup);
    const std::string source = file_.text(kSourceFormat);
    if (!source.empty()) header_.set_detail(kSourceFormat, source);
    read_devices();
  }

  void read_devices() {
    const auto device = file_.dimension(kDeviceDimension);
    if (device.length < 1 || device.length > kMostDevices) {
      file_.fail(fmt::format("dimension {} has length {}, allowed 1 to {}", kDeviceDimension,
                             device.length, kMostDevices));
    }
    const std::size_t serial_length = file_.dimension(kSerialDimension).length;
    for_each_device_column(serial_length, RequireColumns{file_, variables_, device, 0});
    header_.devices.resize(device.length);
    for_each_device_column(serial_length,
                           GetRecords<Device>{file_, variables_, 0, header_.devices});
  }

  TimeReference read_time_reference() const {
    const std::string found = file_.text("time_reference");
    for (const auto reference : {TimeReference::relative, TimeReference::power_on,
                                 TimeReference::ptp, TimeReference::utc, TimeReference::pps}) {
      if (to_string(reference) == found) return reference;
    }
    file_.fail(fmt::format("expected a known time_reference, found \"{}\"", found));
  }

  /// Rejects entry `entry` of a variable if it is not a device of the table.
  void require_known_device(const char* variable, std::uint8_t device, std::size_t entry) const {
    if (device < header_.devices.size()) return;
    file_.fail(fmt::format("entry {} of variable {} is {}, allowed below {} = {}", entry, variable,
                           device, kDeviceDimension, header_.devices.size()));
  }

  /// Reads the next packets of about max_rows rows, and determines their rows and samples.
  void take_packets(std::vector<Packet>& packets, std::size_t max_rows, std::size_t& rows,
                    std::size_t& samples) {
    rows = samples = 0;
    while (rows + samples < max_rows && packets.size() < max_rows) {
      if (next_packet_ == known_packets_.size()) {
        const std::size_t count = std::min(kPacketBlock, packet_count_ - packets_read_);
        if (count == 0) break;
        known_packets_.resize(count);
        for_each_packet_column(
            GetRecords<Packet>{file_, variables_, packets_read_, known_packets_});
        packets_read_ += count;
        next_packet_ = 0;
      }
      packets.push_back(known_packets_[next_packet_++]);
      rows += packets.back().rows;
      if (packets.back().is_imu()) ++samples;
    }
    const bool last = packets_read_ == packet_count_ && next_packet_ == known_packets_.size();
    const std::size_t rows_left = row_count_ - row_, samples_left = imu_count_ - imu_sample_;
    if (rows > rows_left || samples > samples_left ||
        (last && (rows < rows_left || samples < samples_left))) {
      file_.fail(fmt::format("the packets hold {} rows and {} inertial samples, expected {} and {}",
                             row_ + rows, imu_sample_ + samples, row_count_, imu_count_));
    }
  }

  /// Reads rows block by block, so that a damaged block costs no row before it.
  void read_rows(Observations& rows, std::size_t count) {
    Observations block;
    while (rows.size() < count) {
      const std::size_t start = row_ + rows.size();
      const std::size_t length = std::min(kRowBlock - start % kRowBlock, count - rows.size());
      for_each_row_column(block, GetColumns{file_, variables_, start, length});
      for (std::size_t i = 0; i < length; ++i) {
        require_known_device("device", block.device[i], start + i);
      }
      rows.append(block);
    }
  }

  void read_imu(std::vector<ImuSample>& samples, std::size_t count) {
    std::vector<ImuSample> found(count);
    for_each_imu_column(GetRecords<ImuSample>{file_, variables_, imu_sample_, found});
    for (std::size_t i = 0; i < count; ++i) {
      require_known_device("imu_device", found[i].device, imu_sample_ + i);
    }
    samples = std::move(found);
  }

  /// After damage: drops the packets without all their rows and samples, and the rows of an
  /// incomplete packet.
  void keep_whole_packets(Chunk& chunk) const {
    if (packet_count_ == 0) return;
    std::size_t rows = 0, samples = 0, whole = 0;
    for (const auto& packet : chunk.packets) {
      rows += packet.rows;
      samples += packet.is_imu() ? 1 : 0;
      if (rows > chunk.observations.size() || samples > chunk.imu.size()) {
        rows -= packet.rows;
        samples -= packet.is_imu() ? 1 : 0;
        break;
      }
      ++whole;
    }
    chunk.packets.resize(whole);
    chunk.observations.resize(rows);
    chunk.imu.resize(samples);
  }

  std::shared_ptr<const tables::NetcdfInput> input_;  ///< one process for all readers of a file
  const tables::NetcdfInput& file_;
  Variables variables_;
  std::size_t row_count_ = 0, packet_count_ = 0, imu_count_ = 0;
  std::size_t row_ = 0, imu_sample_ = 0, packets_read_ = 0, next_packet_ = 0;
  std::vector<Packet> known_packets_;
  std::optional<FileError> pending_;
};

}  // namespace

std::unique_ptr<Reader> open_recording(const io::InputFile& file, const Progress& progress) {
  return std::make_unique<NetcdfReader>(
      std::make_shared<const tables::NetcdfInput>(file, progress));
}

}  // namespace risley::recordings::netcdf
