// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "risley/recordings/observations.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/writer.hpp"

/// The lossless format: every column, packet header, inertial sample and header field as NetCDF-4.
/// Angles stay in radians here, because a conversion to degrees and back would change their last
/// bits.
namespace risley::recordings::netcdf {

inline constexpr std::string_view kName = "netcdf";
inline constexpr const char* kMarker = "risley_recording";  ///< attribute: version of this layout
inline constexpr std::uint32_t kLayoutVersion = 1;
inline constexpr const char* kHasTimes = "has_times";  ///< attribute; 0: times are shot numbers
inline constexpr const char* kDetailsGroup = "details";

/// The dimensions of the tables, and the entries per block of their variables.
inline constexpr const char* kRowDimension = "row";
inline constexpr const char* kPacketDimension = "packet";
inline constexpr const char* kImuDimension = "imu_sample";
inline constexpr const char* kDeviceDimension = "device_entry";
inline constexpr std::size_t kRowBlock = 32768, kPacketBlock = 1024, kImuBlock = 1024;

/// The inner dimensions.
inline constexpr const char* kByteDimension = "timestamp_byte";
inline constexpr const char* kAxisDimension = "axis";
inline constexpr const char* kSerialDimension = "serial_length";
inline constexpr std::size_t kShortestSerial = 16;

/// One variable: its name, unit and meaning, and the values per entry of its table.
struct NetcdfColumn {
  const char* name;
  const char* units;  ///< nullptr for texts
  const char* long_name;
  const char* inner_dimension = nullptr;  ///< of tables with several values per entry
  std::size_t width = 1;
  bool second_generation = false;  ///< only in files of sensors of Livox's second generation
};

/// Calls a function with every column of the row table.
template <class Rows, class Function>
void for_each_row_column(Rows&& rows, const Function& f) {
  for_each_entry<kObservationColumns>(
      [&f](const ObservationColumn& entry, auto& column) {
        f(NetcdfColumn{entry.variable, entry.unit, entry.meaning}, column);
      },
      rows);
}

/// As for_each_row_column(), for the tables of records: with the members in the columns.
template <class Function>
void for_each_packet_column(Function&& f) {
  f(NetcdfColumn{"packet_rows", "1", "number of rows of the packet"}, &Packet::rows);
  f(NetcdfColumn{"packet_frame", "1", "number of the frame that holds the packet"}, &Packet::frame);
  f(NetcdfColumn{"packet_device_index", "1", "index by which the packet names its device"},
    &Packet::device_index);
  f(NetcdfColumn{"packet_version", "1", "version of the packet"}, &Packet::version);
  f(NetcdfColumn{"packet_slot", "1", "hub port"}, &Packet::slot);
  f(NetcdfColumn{"packet_lidar_id", "1", "lidar number at the hub port"}, &Packet::lidar_id);
  f(NetcdfColumn{"packet_reserved", "1", "reserved byte"}, &Packet::reserved);
  f(NetcdfColumn{"packet_status", "1", "status code of the sensor"}, &Packet::status);
  f(NetcdfColumn{"packet_timestamp_type", "1", "kind of the time stamp"}, &Packet::timestamp_type);
  f(NetcdfColumn{"packet_data_type", "1", "kind of the records"}, &Packet::data_type);
  f(NetcdfColumn{"packet_timestamp", "1", "time stamp as sent", kByteDimension, 8},
    &Packet::timestamp);
  f(NetcdfColumn{"packet_number", "1", "counter of the packet", nullptr, 1, true}, &Packet::number);
}

template <class Function>
void for_each_imu_column(Function&& f) {
  f(NetcdfColumn{"imu_time", "ns", "time of the inertial sample"}, &ImuSample::time_ns);
  f(NetcdfColumn{"imu_device", "1", "row of the device table"}, &ImuSample::device);
  f(NetcdfColumn{"imu_angular_velocity", "radian s-1", "angular velocity", kAxisDimension, 3},
    &ImuSample::angular_velocity);
  f(NetcdfColumn{"imu_acceleration_g", "9.80665 m s-2", "acceleration", kAxisDimension, 3},
    &ImuSample::acceleration_g);
}

/// @param serial_length  of texts, which are padded with NUL
template <class Function>
void for_each_device_column(std::size_t serial_length, Function&& f) {
  f(NetcdfColumn{"device_serial", nullptr, "broadcast code", kSerialDimension, serial_length},
    &Device::serial);
  f(NetcdfColumn{"device_hub_serial", nullptr, "broadcast code of the hub", kSerialDimension,
                 serial_length},
    &Device::hub_serial);
  f(NetcdfColumn{"device_address", nullptr, "IP address", kSerialDimension, serial_length, true},
    &Device::address);
  f(NetcdfColumn{"device_index", "1", "index by which packets name the device"}, &Device::index);
  f(NetcdfColumn{"device_type", "1", "device type of the sensor"}, &Device::type);
  f(NetcdfColumn{"device_extrinsic_enabled", "1", "1 where the pose is to be applied"},
    &Device::extrinsic_enabled);
  f(NetcdfColumn{"device_roll_pitch_yaw", "degree", "attitude", kAxisDimension, 3},
    &Device::roll_pitch_yaw_deg);
  f(NetcdfColumn{"device_translation", "m", "position", kAxisDimension, 3}, &Device::translation_m);
}

/// The type of a column's values, by a vector of them or by a member of records: a number, several,
/// or a text.
template <class Values>
struct ColumnElement {
  using Type = Values;
};
template <class T>
struct ColumnElement<std::vector<T>> : ColumnElement<T> {};
template <class T, std::size_t N>
struct ColumnElement<std::array<T, N>> : ColumnElement<T> {};
template <class Record, class T>
struct ColumnElement<T Record::*> : ColumnElement<T> {};
template <>
struct ColumnElement<std::string> : ColumnElement<char> {};
template <>
struct ColumnElement<bool> : ColumnElement<std::uint8_t> {};
template <class Values>
using ElementOf = typename ColumnElement<Values>::Type;

/// @throws FileError if the file is damaged or of another layout
std::unique_ptr<Reader> open_recording(const io::InputFile& file, const Progress& progress);

/// @throws FileError if the file cannot be written, InvalidArgument for a header without device
std::unique_ptr<Writer> create_recording(const std::string& path, const RecordingHeader& header,
                                         const WriteOptions& options);

}  // namespace risley::recordings::netcdf
