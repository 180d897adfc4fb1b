// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The lossless format: every column, packet header, inertial sample and header field as NetCDF-4.
// Angles stay in radians here, because a conversion to degrees and back would change their last
// bits. Equal recordings give equal bytes, in whatever pieces they are written: blocks of rows and
// of packet headers go to the file in an order that depends on their content alone.
// The NetCDF library is not thread-safe: one NetCDF file of a process at a time.
#include <algorithm>
#include <array>
#include <optional>
#include <type_traits>

#include <fmt/format.h>
#include <netcdf.h>

#include "risley/core/error.hpp"
#include "risley/io/output_file.hpp"
#include "risley/recordings/livox/packet.hpp"

#include "recordings/formats/format.hpp"

namespace risley::recordings {
namespace {

constexpr std::string_view kName = "netcdf";
constexpr std::string_view kSignature = "\x89HDF\r\n\x1a\n";
constexpr const char* kMarker = "risley_recording";  ///< global attribute: version of this layout
constexpr int kLayoutVersion = 1;
constexpr const char* kHasTimes = "has_times";  ///< global attribute; 0: times are shot numbers
constexpr const char* kDetailsGroup = "details";
constexpr std::size_t kRowBlock = 32768, kPacketBlock = 1024, kImuBlock = 1024;
constexpr std::size_t kShortestSerial = 16;

template <class T>
constexpr nc_type nc_type_of() {
  if constexpr (std::is_same_v<T, double>) return NC_DOUBLE;
  if constexpr (std::is_same_v<T, float>) return NC_FLOAT;
  if constexpr (std::is_same_v<T, std::int64_t>) return NC_INT64;
  if constexpr (std::is_same_v<T, std::uint64_t>) return NC_UINT64;
  if constexpr (std::is_same_v<T, std::uint32_t>) return NC_UINT;
  if constexpr (std::is_same_v<T, std::uint8_t>) return NC_UBYTE;
  if constexpr (std::is_same_v<T, char>) return NC_CHAR;
}

/// One variable: its name, unit and meaning, and the values per entry of its table.
struct Column {
  const char* name;
  const char* units;  ///< nullptr for texts
  const char* long_name;
  const char* inner_dimension = nullptr;  ///< of tables with several values per entry
  std::size_t width = 1;
};

/// Calls a function with every column of the row table.
template <class Rows, class Function>
void for_each_column(Rows&& rows, Function&& f) {
  f(Column{"time", "ns", "time of the shot"}, rows.time_ns);
  f(Column{"azimuth", "radian", "azimuth from X towards Y"}, rows.azimuth);
  f(Column{"zenith", "radian", "zenith angle from Z"}, rows.zenith);
  f(Column{"range", "m", "range, 0 where the shot had no return"}, rows.range);
  f(Column{"azimuth_resolution", "radian", "rounding step of the azimuth, 0 where unknown"},
    rows.azimuth_resolution);
  f(Column{"zenith_resolution", "radian", "rounding step of the zenith angle, 0 where unknown"},
    rows.zenith_resolution);
  f(Column{"range_resolution", "m", "rounding step of the range, 0 where unknown"},
    rows.range_resolution);
  f(Column{"intensity", "1", "intensity as the sensor reports it"}, rows.intensity);
  f(Column{"return_number", "1", "number of the return within its shot, from 1"},
    rows.return_number);
  f(Column{"tag", "1", "tag byte of the sensor"}, rows.tag);
  f(Column{"beam", "1", "firing beam, from 0"}, rows.beam);
  f(Column{"device", "1", "row of the device table"}, rows.device);
  f(Column{"valid", "1", "1 where the direction can be trusted"}, rows.valid);
}

constexpr const char* kByteDimension = "timestamp_byte";
constexpr const char* kAxisDimension = "axis";

/// The packet table as columns.
struct PacketColumns {
  std::vector<std::uint32_t> rows, status;
  std::vector<std::uint64_t> frame;
  std::vector<std::uint8_t> device_index, version, slot, lidar_id, reserved, timestamp_type,
      data_type, timestamp;
};

template <class Packets, class Function>
void for_each_packet_column(Packets&& p, Function&& f) {
  f(Column{"packet_rows", "1", "number of rows of the packet"}, p.rows);
  f(Column{"packet_frame", "1", "number of the frame that holds the packet"}, p.frame);
  f(Column{"packet_device_index", "1", "index by which the packet names its device"},
    p.device_index);
  f(Column{"packet_version", "1", "version of the packet"}, p.version);
  f(Column{"packet_slot", "1", "hub port"}, p.slot);
  f(Column{"packet_lidar_id", "1", "lidar number at the hub port"}, p.lidar_id);
  f(Column{"packet_reserved", "1", "reserved byte"}, p.reserved);
  f(Column{"packet_status", "1", "status code of the sensor"}, p.status);
  f(Column{"packet_timestamp_type", "1", "kind of the time stamp"}, p.timestamp_type);
  f(Column{"packet_data_type", "1", "kind of the records"}, p.data_type);
  f(Column{"packet_timestamp", "1", "time stamp as sent", kByteDimension, 8}, p.timestamp);
}

/// The inertial samples as columns.
struct ImuColumns {
  std::vector<std::int64_t> time_ns;
  std::vector<std::uint8_t> device;
  std::vector<float> angular_velocity, acceleration_g;
};

template <class Imu, class Function>
void for_each_imu_column(Imu&& imu, Function&& f) {
  f(Column{"imu_time", "ns", "time of the inertial sample"}, imu.time_ns);
  f(Column{"imu_device", "1", "row of the device table"}, imu.device);
  f(Column{"imu_angular_velocity", "radian s-1", "angular velocity", kAxisDimension, 3},
    imu.angular_velocity);
  f(Column{"imu_acceleration_g", "9.80665 m s-2", "acceleration", kAxisDimension, 3},
    imu.acceleration_g);
}

/// The device table as columns; serials are padded with NUL.
struct DeviceColumns {
  std::size_t serial_length = kShortestSerial;
  std::vector<char> serial, hub_serial;
  std::vector<std::uint8_t> index, type, extrinsic_enabled;
  std::vector<float> roll_pitch_yaw_deg, translation_m;
};

template <class Devices, class Function>
void for_each_device_column(Devices&& d, Function&& f) {
  const char* const length = "serial_length";
  f(Column{"device_serial", nullptr, "broadcast code", length, d.serial_length}, d.serial);
  f(Column{"device_hub_serial", nullptr, "broadcast code of the hub", length, d.serial_length},
    d.hub_serial);
  f(Column{"device_index", "1", "index by which packets name the device"}, d.index);
  f(Column{"device_type", "1", "device type of the sensor"}, d.type);
  f(Column{"device_extrinsic_enabled", "1", "1 where the pose is to be applied"},
    d.extrinsic_enabled);
  f(Column{"device_roll_pitch_yaw", "degree", "attitude", kAxisDimension, 3}, d.roll_pitch_yaw_deg);
  f(Column{"device_translation", "m", "position", kAxisDimension, 3}, d.translation_m);
}

/// An open NetCDF file; the calls throw FileError with the library's words.
class NcFile {
 public:
  explicit NcFile(std::string path) : path_(std::move(path)) {}
  NcFile(const NcFile&) = delete;
  NcFile& operator=(const NcFile&) = delete;
  ~NcFile() {
    if (id_) nc_close(*id_);
  }

  void create(const std::string& temporary_path) {
    int id = 0;
    check(nc_create(temporary_path.c_str(), NC_NETCDF4 | NC_CLOBBER, &id), "be created");
    id_ = id;
  }
  void open() {
    int id = 0;
    check(nc_open(path_.c_str(), NC_NOWRITE, &id), "be opened as NetCDF");
    id_ = id;
  }
  void close() {
    const int status = nc_close(*id_);
    id_.reset();
    check(status, "be completed");
  }
  int id() const { return *id_; }
  const std::string& path() const { return path_; }

  /// @param action  what could not be done: the message reads "cannot <action>: <reason>"
  void check(int status, const std::string& action) const {
    if (status != NC_NOERR) fail(fmt::format("cannot {}: {}", action, nc_strerror(status)));
  }
  [[noreturn]] void fail(const std::string& problem) const { throw FileError(path_, {}, problem); }

 private:
  std::string path_;
  std::optional<int> id_;
};

void put_text(const NcFile& file, int group, int variable, const char* name,
              std::string_view text) {
  file.check(nc_put_att_text(group, variable, name, text.size(), text.data()),
             fmt::format("write attribute {}", name));
}

std::string get_text(const NcFile& file, int group, const char* name) {
  nc_type type = NC_NAT;
  std::size_t length = 0;
  if (nc_inq_att(group, NC_GLOBAL, name, &type, &length) != NC_NOERR || type != NC_CHAR) {
    file.fail(fmt::format("expected the text attribute {}, found none", name));
  }
  std::string text(length, '\0');
  file.check(nc_get_att_text(group, NC_GLOBAL, name, text.data()),
             fmt::format("read attribute {}", name));
  return text;
}

void put_number(const NcFile& file, const char* name, std::uint32_t value) {
  file.check(nc_put_att_uint(file.id(), NC_GLOBAL, name, NC_UINT, 1, &value),
             fmt::format("write attribute {}", name));
}

std::uint32_t get_number(const NcFile& file, const char* name) {
  nc_type type = NC_NAT;
  std::size_t length = 0;
  std::uint32_t value = 0;
  if (nc_inq_att(file.id(), NC_GLOBAL, name, &type, &length) != NC_NOERR || length != 1 ||
      nc_get_att_uint(file.id(), NC_GLOBAL, name, &value) != NC_NOERR) {
    file.fail(fmt::format("expected the number attribute {}, found none", name));
  }
  return value;
}

std::size_t dimension_length(const NcFile& file, const char* name) {
  int dimension = 0;
  std::size_t length = 0;
  if (nc_inq_dimid(file.id(), name, &dimension) != NC_NOERR ||
      nc_inq_dimlen(file.id(), dimension, &length) != NC_NOERR) {
    file.fail(fmt::format("expected the dimension {}, found none", name));
  }
  return length;
}

/// Blocks are written and read whole and in order: a cache of many would only cost memory.
template <class T>
void keep_few_blocks(const NcFile& file, int variable, const Column& column, std::size_t block) {
  file.check(
      nc_set_var_chunk_cache(file.id(), variable, 2 * block * column.width * sizeof(T), 7, 1.0F),
      fmt::format("set the cache of variable {}", column.name));
}

/// Defines variables of one table, whose entries run along `dimension`.
/// @param block  entries per compressed block; 0 for a table of fixed length, kept in one piece
struct DefineColumns {
  const NcFile& file;
  int dimension;
  std::size_t block;

  template <class T>
  void operator()(const Column& column, const std::vector<T>&) const {
    const std::string action = fmt::format("define variable {}", column.name);
    std::array<int, 2> dimensions{dimension, 0};
    std::array<std::size_t, 2> chunk{block, column.width};
    int variable = 0;
    const int rank = column.inner_dimension != nullptr ? 2 : 1;
    if (rank == 2) {
      file.check(nc_inq_dimid(file.id(), column.inner_dimension, &dimensions[1]), action);
    }
    file.check(
        nc_def_var(file.id(), column.name, nc_type_of<T>(), rank, dimensions.data(), &variable),
        action);
    if (block > 0) {
      file.check(nc_def_var_chunking(file.id(), variable, NC_CHUNKED, chunk.data()), action);
      file.check(nc_def_var_deflate(file.id(), variable, NC_SHUFFLE, 1, 1), action);
      file.check(nc_def_var_fletcher32(file.id(), variable, NC_FLETCHER32), action);
      keep_few_blocks<T>(file, variable, column, block);
    }
    if (column.units != nullptr) put_text(file, file.id(), variable, "units", column.units);
    put_text(file, file.id(), variable, "long_name", column.long_name);
  }
};

/// Writes entries [offset, offset + count) of the given columns at entry `start` of the file.
struct PutColumns {
  const NcFile& file;
  std::size_t start, offset, count;

  template <class T>
  void operator()(const Column& column, const std::vector<T>& values) const {
    const std::string action = fmt::format("write variable {}", column.name);
    int variable = 0;
    const std::array<std::size_t, 2> starts{start, 0}, counts{count, column.width};
    file.check(nc_inq_varid(file.id(), column.name, &variable), action);
    file.check(nc_put_vara(file.id(), variable, starts.data(), counts.data(),
                           values.data() + offset * column.width),
               action);
  }
};

/// Reads entries [start, start + count) into the columns.
struct GetColumns {
  const NcFile& file;
  std::size_t start, count;

  template <class T>
  void operator()(const Column& column, std::vector<T>& values) const {
    int variable = 0;
    const std::array<std::size_t, 2> starts{start, 0}, counts{count, column.width};
    values.resize(count * column.width);
    if (count == 0) return;
    file.check(nc_inq_varid(file.id(), column.name, &variable),
               fmt::format("find variable {}", column.name));
    file.check(
        nc_get_vara(file.id(), variable, starts.data(), counts.data(), values.data()),
        fmt::format("read entries {} to {} of variable {}", start, start + count - 1, column.name));
  }
};

/// Refuses a file whose variables are not those of this layout.
struct RequireColumns {
  const NcFile& file;
  const char* dimension;
  std::size_t block = 0;  ///< as in DefineColumns

  template <class T>
  void operator()(const Column& column, const std::vector<T>&) const {
    int variable = 0, rank = 0;
    nc_type type = NC_NAT;
    const int expected_rank = column.inner_dimension != nullptr ? 2 : 1;
    if (nc_inq_varid(file.id(), column.name, &variable) != NC_NOERR ||
        nc_inq_vartype(file.id(), variable, &type) != NC_NOERR ||
        nc_inq_varndims(file.id(), variable, &rank) != NC_NOERR || rank != expected_rank ||
        type != nc_type_of<T>()) {
      file.fail(fmt::format("expected variable {} of a risley recording, found none of its kind",
                            column.name));
    }
    std::array<int, 2> dimensions{};
    file.check(nc_inq_vardimid(file.id(), variable, dimensions.data()), "read the dimensions");
    require_dimension(column, dimensions[0], dimension, std::nullopt);
    if (rank == 2) require_dimension(column, dimensions[1], column.inner_dimension, column.width);
    if (block > 0) keep_few_blocks<T>(file, variable, column, block);
  }

  void require_dimension(const Column& column, int id, const char* name,
                         std::optional<std::size_t> length) const {
    std::array<char, NC_MAX_NAME + 1> found{};
    std::size_t found_length = 0;
    file.check(nc_inq_dim(file.id(), id, found.data(), &found_length), "read a dimension");
    if (std::string_view(found.data()) == name && (!length || *length == found_length)) return;
    file.fail(fmt::format("expected variable {} along dimension {}, found {} of length {}",
                          column.name, name, found.data(), found_length));
  }
};

PacketColumns columns_of(const std::vector<Packet>& packets, std::size_t count) {
  PacketColumns columns;
  for (std::size_t i = 0; i < count; ++i) {
    const Packet& p = packets[i];
    columns.rows.push_back(p.rows);
    columns.frame.push_back(p.frame);
    columns.device_index.push_back(p.device_index);
    columns.version.push_back(p.version);
    columns.slot.push_back(p.slot);
    columns.lidar_id.push_back(p.lidar_id);
    columns.reserved.push_back(p.reserved);
    columns.status.push_back(p.status);
    columns.timestamp_type.push_back(p.timestamp_type);
    columns.data_type.push_back(p.data_type);
    columns.timestamp.insert(columns.timestamp.end(), p.timestamp.begin(), p.timestamp.end());
  }
  return columns;
}

Packet packet_of(const PacketColumns& columns, std::size_t i) {
  Packet p;
  p.rows = columns.rows[i];
  p.frame = columns.frame[i];
  p.device_index = columns.device_index[i];
  p.version = columns.version[i];
  p.slot = columns.slot[i];
  p.lidar_id = columns.lidar_id[i];
  p.reserved = columns.reserved[i];
  p.status = columns.status[i];
  p.timestamp_type = columns.timestamp_type[i];
  p.data_type = columns.data_type[i];
  std::copy_n(columns.timestamp.data() + i * p.timestamp.size(), p.timestamp.size(),
              p.timestamp.begin());
  return p;
}

DeviceColumns columns_of(const std::vector<Device>& devices) {
  DeviceColumns columns;
  for (const auto& device : devices) {
    columns.serial_length =
        std::max({columns.serial_length, device.serial.size(), device.hub_serial.size()});
  }
  const auto append_padded = [&](std::vector<char>& target, const std::string& text) {
    target.insert(target.end(), text.begin(), text.end());
    target.resize(target.size() + columns.serial_length - text.size(), '\0');
  };
  for (const auto& device : devices) {
    append_padded(columns.serial, device.serial);
    append_padded(columns.hub_serial, device.hub_serial);
    columns.index.push_back(device.index);
    columns.type.push_back(device.type);
    columns.extrinsic_enabled.push_back(device.extrinsic_enabled ? 1 : 0);
    columns.roll_pitch_yaw_deg.insert(columns.roll_pitch_yaw_deg.end(),
                                      device.roll_pitch_yaw_deg.begin(),
                                      device.roll_pitch_yaw_deg.end());
    columns.translation_m.insert(columns.translation_m.end(), device.translation_m.begin(),
                                 device.translation_m.end());
  }
  return columns;
}

Device device_of(const DeviceColumns& columns, std::size_t i) {
  const auto text = [&](const std::vector<char>& source) {
    std::string padded(source.data() + i * columns.serial_length, columns.serial_length);
    return padded.substr(0, padded.find_last_not_of('\0') + 1);
  };
  Device device;
  device.serial = text(columns.serial);
  device.hub_serial = text(columns.hub_serial);
  device.index = columns.index[i];
  device.type = columns.type[i];
  device.extrinsic_enabled = columns.extrinsic_enabled[i] != 0;
  std::copy_n(columns.roll_pitch_yaw_deg.data() + 3 * i, 3, device.roll_pitch_yaw_deg.begin());
  std::copy_n(columns.translation_m.data() + 3 * i, 3, device.translation_m.begin());
  return device;
}

class NetcdfWriter final : public Writer {
 public:
  NetcdfWriter(const std::string& path, const RecordingHeader& header)
      : output_(path), file_(path) {
    if (header.devices.empty()) {
      throw InvalidArgument("RecordingHeader::devices is empty, expected at least one device");
    }
    file_.create(output_.temporary_path());
    write_header(header);
  }

  void write(const Chunk& chunk) override {
    require_whole_packets(chunk);
    rows_.append(chunk.observations);
    packets_.insert(packets_.end(), chunk.packets.begin(), chunk.packets.end());
    append_imu(chunk.imu);
    flush(false);
  }

  void close() override {
    flush(true);
    const std::size_t samples = imu_.time_ns.size();
    for (std::size_t start = 0; start < samples; start += kImuBlock) {
      for_each_imu_column(imu_,
                          PutColumns{file_, start, start, std::min(kImuBlock, samples - start)});
    }
    file_.close();
    output_.commit();
  }

 private:
  void write_header(const RecordingHeader& header) {
    const int id = file_.id();
    put_text(file_, id, NC_GLOBAL, "Conventions", "CF-1.9");
    put_text(file_, id, NC_GLOBAL, "title", "Recording of a scanning lidar");
    put_number(file_, kMarker, kLayoutVersion);
    const bool unknown_source = header.format == kName && source_format(header) == kName;
    put_text(file_, id, NC_GLOBAL, kSourceFormat, unknown_source ? "" : source_format(header));
    put_text(file_, id, NC_GLOBAL, "time_reference", to_string(header.time_reference));
    put_number(file_, kHasTimes, header.has_times ? 1 : 0);
    put_number(file_, "has_range", header.has_range ? 1 : 0);
    put_number(file_, "has_intensity", header.has_intensity ? 1 : 0);
    put_number(file_, "cartesian", header.cartesian ? 1 : 0);
    put_number(file_, "returns_per_shot", static_cast<std::uint32_t>(header.returns_per_shot));
    put_number(file_, "frame_duration_ms", header.frame_duration_ms);
    int details = 0;
    file_.check(nc_def_grp(id, kDetailsGroup, &details), "define the group of details");
    for (const auto& [name, value] : header.details) {
      if (name != kSourceFormat) put_text(file_, details, NC_GLOBAL, name.c_str(), value);
    }
    const DeviceColumns devices = columns_of(header.devices);
    define_dimension(kByteDimension, std::tuple_size_v<decltype(Packet::timestamp)>);
    define_dimension(kAxisDimension, 3);
    define_dimension("serial_length", devices.serial_length);
    const int device = define_dimension("device_entry", header.devices.size());
    for_each_column(rows_, DefineColumns{file_, define_dimension("row", NC_UNLIMITED), kRowBlock});
    for_each_packet_column(
        PacketColumns{},
        DefineColumns{file_, define_dimension("packet", NC_UNLIMITED), kPacketBlock});
    for_each_imu_column(
        imu_, DefineColumns{file_, define_dimension("imu_sample", NC_UNLIMITED), kImuBlock});
    for_each_device_column(devices, DefineColumns{file_, device, 0});
    file_.check(nc_enddef(id), "be prepared");
    for_each_device_column(devices, PutColumns{file_, 0, 0, header.devices.size()});
  }

  int define_dimension(const char* name, std::size_t length) {
    int dimension = 0;
    file_.check(nc_def_dim(file_.id(), name, length, &dimension),
                fmt::format("define dimension {}", name));
    return dimension;
  }

  /// Packets, where there are any, must account for all rows and inertial samples.
  void require_whole_packets(const Chunk& chunk) {
    if (chunk.observations.size() == 0 && chunk.imu.empty() && chunk.packets.empty()) return;
    if (!with_packets_) with_packets_ = !chunk.packets.empty();
    std::size_t rows = 0, samples = 0;
    for (const auto& packet : chunk.packets) {
      rows += packet.rows;
      if (packet.data_type == livox::kImuDataType) ++samples;
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

  void append_imu(const std::vector<ImuSample>& samples) {
    for (const auto& sample : samples) {
      imu_.time_ns.push_back(sample.time_ns);
      imu_.device.push_back(sample.device);
      imu_.angular_velocity.insert(imu_.angular_velocity.end(), sample.angular_velocity.begin(),
                                   sample.angular_velocity.end());
      imu_.acceleration_g.insert(imu_.acceleration_g.end(), sample.acceleration_g.begin(),
                                 sample.acceleration_g.end());
    }
  }

  /// Writes the blocks that are full, and at the end the rest: those of rows and of packets in
  /// the order in which the recording completes them, rows first.
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
        for_each_column(rows_, PutColumns{file_, rows_written_, done, rows});
        rows_written_ += rows;
        done += rows;
      } else if (packets > 0) {
        for_each_packet_column(columns_of(packets_, packets),
                               PutColumns{file_, packets_written_, 0, packets});
        packets_.erase(packets_.begin(), packets_.begin() + static_cast<std::ptrdiff_t>(packets));
        packets_written_ += packets;
        rows_of_written_packets_ = packets_end;
      } else {
        break;
      }
    }
    if (done == 0) return;
    for_each_column(rows_, [done](const Column&, auto& column) {
      column.erase(column.begin(), column.begin() + static_cast<std::ptrdiff_t>(done));
    });
  }

  io::OutputFile output_;
  NcFile file_;  // after output_: closed before the temporary is removed
  Observations rows_;
  std::vector<Packet> packets_;
  ImuColumns imu_;  ///< to the end: a sample takes 33 bytes and there are 200 per second
  std::optional<bool> with_packets_;
  std::size_t rows_written_ = 0, packets_written_ = 0;
  std::uint64_t rows_of_written_packets_ = 0;
};

class NetcdfReader final : public Reader {
 public:
  explicit NetcdfReader(const std::string& path) : file_(path) {
    file_.open();
    read_header();
    row_count_ = dimension_length(file_, "row");
    packet_count_ = dimension_length(file_, "packet");
    imu_count_ = dimension_length(file_, "imu_sample");
    for_each_column(Observations{}, RequireColumns{file_, "row", kRowBlock});
    for_each_packet_column(PacketColumns{}, RequireColumns{file_, "packet", kPacketBlock});
    for_each_imu_column(ImuColumns{}, RequireColumns{file_, "imu_sample", kImuBlock});
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

  double fraction_read() const override {
    const std::size_t total = row_count_ + imu_count_;
    return total == 0 ? 1.0 : static_cast<double>(row_ + imu_sample_) / static_cast<double>(total);
  }

 private:
  void read_header() {
    const int id = file_.id();
    int marker = 0;
    if (nc_inq_attid(id, NC_GLOBAL, kMarker, &marker) != NC_NOERR) {
      file_.fail(fmt::format(
          "a NetCDF file, but not of a recording: its global attribute {} is missing", kMarker));
    }
    if (const auto version = get_number(file_, kMarker); version != kLayoutVersion) {
      file_.fail(fmt::format("expected {} = {}, found {}", kMarker, kLayoutVersion, version));
    }
    header_.format = kName;
    header_.time_reference = read_time_reference();
    int has_times = 0;  // files of earlier versions have times and do not say so
    if (nc_inq_attid(id, NC_GLOBAL, kHasTimes, &has_times) == NC_NOERR) {
      header_.has_times = get_number(file_, kHasTimes) != 0;
    }
    header_.has_range = get_number(file_, "has_range") != 0;
    header_.has_intensity = get_number(file_, "has_intensity") != 0;
    header_.cartesian = get_number(file_, "cartesian") != 0;
    header_.returns_per_shot = static_cast<int>(get_number(file_, "returns_per_shot"));
    header_.frame_duration_ms = get_number(file_, "frame_duration_ms");
    read_details();
    const std::string source = get_text(file_, id, kSourceFormat);
    if (!source.empty()) header_.set_detail(kSourceFormat, source);
    DeviceColumns devices;
    devices.serial_length = dimension_length(file_, "serial_length");
    const std::size_t device_count = dimension_length(file_, "device_entry");
    for_each_device_column(devices, RequireColumns{file_, "device_entry"});
    for_each_device_column(devices, GetColumns{file_, 0, device_count});
    for (std::size_t i = 0; i < device_count; ++i) header_.devices.push_back(device_of(devices, i));
  }

  TimeReference read_time_reference() const {
    const std::string found = get_text(file_, file_.id(), "time_reference");
    for (const auto reference : {TimeReference::relative, TimeReference::power_on,
                                 TimeReference::ptp, TimeReference::utc, TimeReference::pps}) {
      if (to_string(reference) == found) return reference;
    }
    file_.fail(fmt::format("expected a known time_reference, found \"{}\"", found));
  }

  void read_details() {
    int group = 0, count = 0;
    file_.check(nc_inq_grp_ncid(file_.id(), kDetailsGroup, &group), "read the group of details");
    file_.check(nc_inq_natts(group, &count), "read the group of details");
    for (int i = 0; i < count; ++i) {
      std::array<char, NC_MAX_NAME + 1> name{};
      file_.check(nc_inq_attname(group, NC_GLOBAL, i, name.data()), "read the name of a detail");
      header_.details.emplace_back(name.data(), get_text(file_, group, name.data()));
    }
  }

  /// Takes the next packets of about max_rows rows, and says what they own.
  void take_packets(std::vector<Packet>& packets, std::size_t max_rows, std::size_t& rows,
                    std::size_t& samples) {
    rows = samples = 0;
    while (rows + samples < max_rows && packets.size() < max_rows) {
      if (next_packet_ == known_packets_.rows.size()) {
        const std::size_t count = std::min(kPacketBlock, packet_count_ - packets_read_);
        if (count == 0) break;
        for_each_packet_column(known_packets_, GetColumns{file_, packets_read_, count});
        packets_read_ += count;
        next_packet_ = 0;
      }
      packets.push_back(packet_of(known_packets_, next_packet_++));
      rows += packets.back().rows;
      if (packets.back().data_type == livox::kImuDataType) ++samples;
    }
    const bool last = packets_read_ == packet_count_ && next_packet_ == known_packets_.rows.size();
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
      for_each_column(block, GetColumns{file_, start, length});
      rows.append(block);
    }
  }

  void read_imu(std::vector<ImuSample>& samples, std::size_t count) {
    ImuColumns columns;
    for_each_imu_column(columns, GetColumns{file_, imu_sample_, count});
    for (std::size_t i = 0; i < count; ++i) {
      ImuSample sample;
      sample.time_ns = columns.time_ns[i];
      sample.device = columns.device[i];
      std::copy_n(columns.angular_velocity.data() + 3 * i, 3, sample.angular_velocity.begin());
      std::copy_n(columns.acceleration_g.data() + 3 * i, 3, sample.acceleration_g.begin());
      samples.push_back(sample);
    }
  }

  /// After damage: drops the packets that did not get all their rows and samples, and the rows of
  /// a packet that is not whole.
  void keep_whole_packets(Chunk& chunk) const {
    if (packet_count_ == 0) return;
    std::size_t rows = 0, samples = 0, whole = 0;
    for (const auto& packet : chunk.packets) {
      rows += packet.rows;
      samples += packet.data_type == livox::kImuDataType ? 1 : 0;
      if (rows > chunk.observations.size() || samples > chunk.imu.size()) {
        rows -= packet.rows;
        samples -= packet.data_type == livox::kImuDataType ? 1 : 0;
        break;
      }
      ++whole;
    }
    chunk.packets.resize(whole);
    chunk.observations.resize(rows);
    chunk.imu.resize(samples);
  }

  NcFile file_;
  std::size_t row_count_ = 0, packet_count_ = 0, imu_count_ = 0;
  std::size_t row_ = 0, imu_sample_ = 0, packets_read_ = 0, next_packet_ = 0;
  PacketColumns known_packets_;
  std::optional<FileError> pending_;
};

}  // namespace

const Format kNetcdfFormat = {
    kName,
    ".nc",
    "NetCDF-4, the lossless format: everything a recording holds",
    [](std::string_view head) { return head.starts_with(kSignature); },
    [](const std::string& path) -> std::unique_ptr<Reader> {
      return std::make_unique<NetcdfReader>(path);
    },
    [](const std::string& path, const RecordingHeader& header) -> std::unique_ptr<Writer> {
      return std::make_unique<NetcdfWriter>(path, header);
    },
    true,
};

}  // namespace risley::recordings
