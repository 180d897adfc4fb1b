// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "risley/core/columns.hpp"

namespace risley::recordings {

/// Observations as columns, one row per return (all returns of one shot share its time and follow
/// each other). Every column has the same length.
struct Observations {
  /// Time of the shot, ns. The origin is the recording's (RecordingHeader::time_reference); a
  /// clock that wraps every second (PPS) has been made continuous by the reader. The number of the
  /// shot in firing order if the recording has no times (RecordingHeader::has_times).
  std::vector<std::int64_t> time_ns;
  /// Azimuth from X towards Y in (-pi, pi], zenith from Z in [0, pi], rad. Meaningful if valid; a
  /// null return keeps the angles in its record, or NaN if there are none.
  std::vector<double> azimuth, zenith;
  /// Range, m; 0 if the shot had no return, NaN if the format holds no ranges.
  std::vector<double> range;
  /// Width of the format's rounding step at this point, rad, rad and m; 0 if values are not rounded
  /// or the step is unknown. A Cartesian record of step q has q / (r sin zenith), q / r and q: its
  /// rounding error is the same in all directions.
  std::vector<float> azimuth_resolution, zenith_resolution, range_resolution;
  std::vector<std::uint8_t> intensity;      ///< as the sensor reports it, 0-255
  std::vector<std::uint8_t> return_number;  ///< from 1
  std::vector<std::uint8_t> tag;            ///< the format's tag byte, 0 without one
  std::vector<std::uint8_t> beam;           ///< firing beam ("line") from 0; 0 on one-beam sensors
  std::vector<std::uint8_t> device;         ///< row of RecordingHeader::devices
  std::vector<std::uint8_t> valid;          ///< 1 if the direction can be trusted

  std::size_t size() const { return time_ns.size(); }
  void clear();                    ///< leaves no row
  void resize(std::size_t rows);   ///< gives every column this many rows
  void reserve(std::size_t rows);  ///< allocates memory for this many
  /// @throws InvalidArgument as require_columns()
  void append(const Observations& other);
  /// Appends rows [begin, end) of another. @throws InvalidArgument as append(), and beyond its rows
  void append(const Observations& other, std::size_t begin, std::size_t end);
  /// Appends some rows of another. @throws InvalidArgument as append(), and beyond its rows
  void append(const Observations& other, std::span<const std::size_t> rows);
  /// Removes rows from the beginning.
  /// @throws InvalidArgument when there are fewer, and as require_columns()
  void drop_front(std::size_t rows);
};

/// A column of observations.
struct ObservationColumn {
  ColumnPlace<Observations, std::vector<std::int64_t>, std::vector<double>, std::vector<float>,
              std::vector<std::uint8_t>>
      place;
  const char *name, *variable;  ///< in memory and Python; in NetCDF
  const char *unit, *meaning;   ///< as NetCDF has them
};

/// All columns: rows are created, copied and checked, the lossless format is written and read, and
/// Python's arrays are made by this list.
inline constexpr ObservationColumn kObservationColumns[] = {
    {&Observations::time_ns, "time_ns", "time", "ns", "time of the shot"},
    {&Observations::azimuth, "azimuth", "azimuth", "radian", "azimuth from X towards Y"},
    {&Observations::zenith, "zenith", "zenith", "radian", "zenith angle from Z"},
    {&Observations::range, "range", "range", "m", "range, 0 where the shot had no return"},
    {&Observations::azimuth_resolution, "azimuth_resolution", "azimuth_resolution", "radian",
     "rounding step of the azimuth, 0 where unknown"},
    {&Observations::zenith_resolution, "zenith_resolution", "zenith_resolution", "radian",
     "rounding step of the zenith angle, 0 where unknown"},
    {&Observations::range_resolution, "range_resolution", "range_resolution", "m",
     "rounding step of the range, 0 where unknown"},
    {&Observations::intensity, "intensity", "intensity", "1", "intensity as the sensor reports it"},
    {&Observations::return_number, "return_number", "return_number", "1",
     "number of the return within its shot, from 1"},
    {&Observations::tag, "tag", "tag", "1", "tag byte of the sensor"},
    {&Observations::beam, "beam", "beam", "1", "firing beam, from 0"},
    {&Observations::device, "device", "device", "1", "row of the device table"},
    {&Observations::valid, "valid", "valid", "1", "1 if the direction can be trusted"},
};

/// @throws InvalidArgument when a column has another length than time_ns
void require_columns(const Observations& rows);
/// Sets `valid` for columns filled elsewhere: 1 if both angles are finite and the range, unless it
/// is NaN, is above 0.
void mark_valid(Observations& rows);
/// @throws InvalidArgument with the row of a valid direction with an azimuth outside [-pi, pi] or a
/// zenith outside [0, pi]
void require_angles(const Observations& rows);

/// Whether a row is a further return of the previous row's shot, at the same time: by its return
/// number, or by the same direction to within rounding. @param row  at least 1
bool is_further_return(const Observations& rows, std::size_t row);

/// Header of one sensor data packet as it was recorded, kept so that a packet format can be
/// written again byte by byte.
struct Packet {
  std::uint32_t rows = 0;    ///< observations of this packet in the chunk, in order; 0 for IMU
  std::uint64_t frame = 0;   ///< number of the file's frame that holds it, from 0
  std::uint32_t number = 0;  ///< counter of the second generation's packets, 16 bits
  /// Packets of the second generation have version 0, and no slot, lidar_id and status.
  std::uint8_t device_index = 0, version = 5, slot = 1, lidar_id = 1, reserved = 0;
  std::uint32_t status = 0;
  std::uint8_t timestamp_type = 0, data_type = 1;
  std::array<std::uint8_t, 8> timestamp{};

  /// Whether it holds an inertial sample and no points.
  bool is_imu() const { return rows == 0; }
};

/// One inertial sample as the sensor sends it: rad/s and multiples of g.
struct ImuSample {
  std::int64_t time_ns = 0;
  std::uint8_t device = 0;
  std::array<float, 3> angular_velocity{}, acceleration_g{};
};

/// A piece of a recording: rows, and, for packet formats, the packets they came in. The packets are
/// in file order, and each IMU packet owns the next entry of imu.
struct Chunk {
  Observations observations;
  std::vector<Packet> packets;
  std::vector<ImuSample> imu;
  /// Rows at which packets begin whose rows all have one time in the file; see
  /// RecordingHeader::packet_shots.
  std::vector<std::size_t> packet_begins;

  /// Clears all rows, packets and inertial samples.
  void clear();
  /// What follows this one.
  void append(Chunk&& next);
};

/// Device::type of Livox's sensors.
inline constexpr std::uint8_t kMid40 = 1,  ///< Mid-40
    kTele15 = 2,                           ///< Tele-15
    kHorizon = 3,                          ///< Horizon
    kMid70 = 6,                            ///< Mid-70
    kAvia = 7,                             ///< Avia
    kMid360 = 9,                           ///< Mid-360
    kHap = 10,                             ///< HAP (TX)
    kHapT1 = 15,                           ///< HAP-T1
    kPa = 16,                              ///< PA
    kMid360s = 35,                         ///< Mid-360s
    kAvia2 = 40;                           ///< Avia2
/// A type of Livox's sensors.
struct LivoxType {
  std::uint8_t number;           ///< Device::type
  std::string_view name;         ///< "Mid-40"
  bool fast;                     ///< more than 100,000 shots a second, and inertial samples
  bool first_generation = true;  ///< its packets are those of LVX 1.1
};
/// All of them.
inline constexpr std::array kLivoxTypes{
    LivoxType{kMid40, "Mid-40", false},     LivoxType{kTele15, "Tele-15", true},
    LivoxType{kHorizon, "Horizon", true},   LivoxType{kMid70, "Mid-70", false},
    LivoxType{kAvia, "Avia", true},         LivoxType{kMid360, "Mid-360", true, false},
    LivoxType{kHap, "HAP", true, false},    LivoxType{kHapT1, "HAP-T1", true, false},
    LivoxType{kPa, "PA", true, false},      LivoxType{kMid360s, "Mid-360s", true, false},
    LivoxType{kAvia2, "Avia2", true, false}};
/// One by its number, or nullptr.
const LivoxType* livox_type(std::uint8_t number);
/// "1 (Mid-40), 2 (Tele-15), ...": those of a generation that messages list as allowed.
std::string livox_types_text(bool first_generation = true);
/// Whether sensors of this type send the packets of the second generation.
bool is_second_generation(std::uint8_t type);
/// Device::type of a sensor that a format does not name, or only as not a Mid-40.
inline constexpr std::uint8_t kUnknownDeviceType = 255;

/// One sensor of a recording.
struct Device {
  std::string serial;      ///< broadcast code, e.g. "0TFDG3B006H2Z11"; empty when unknown
  std::string topic;       ///< of a bag, with its messages; empty in other formats
  std::string hub_serial;  ///< broadcast code of the hub, empty without one
  std::string address;     ///< of the second generation, "192.168.1.112"; empty when unknown
  std::uint8_t index = 0;  ///< the key by which packets name it
  std::uint8_t type = kMid40;
  /// The file does not name the type: it is derived from rates, tags and numbers of returns.
  bool type_inferred = false;
  bool extrinsic_enabled = false;
  std::array<float, 3> roll_pitch_yaw_deg{};
  std::array<float, 3> translation_m{};
};

/// Commercial name of a Livox device type, "unknown" for others.
std::string device_type_name(std::uint8_t type);

/// Origin of the times.
enum class TimeReference : std::uint8_t { relative, power_on, ptp, utc, pps };

/// "relative", "power-on", "PTP", "UTC" or "PPS".
std::string to_string(TimeReference reference);

/// An error in the count of a recording's shots.
struct ShotSlip {
  std::uint64_t row = 0;   ///< first observation after it, counted from 0
  std::int64_t shots = 0;  ///< missing ones before that row; below 0: repeated ones
  /// Their number is known; otherwise only which emitters fire after it (shots modulo their
  /// number), and times continue after kUnknownGap.
  bool counted = true;
};

/// Properties of a recording known before its first row is read.
struct RecordingHeader {
  std::string format;           ///< short name, e.g. "lvx-1.1", "scan-sequence-csv"
  std::vector<Device> devices;  ///< at least one
  TimeReference time_reference = TimeReference::relative;
  /// By which UTC stamps of messages are later than times from power-on, ns; empty without them.
  std::optional<std::int64_t> stamps_after_times_ns = {};
  /// false when the file holds no times of single shots: Observations::time_ns then has shot
  /// numbers 0, 1, 2, ..., in which shots without return and lost ones keep their places.
  bool has_times = true;
  /// If it holds none: there are times, but all of them are the same.
  bool all_times_equal = false;
  /// Shots per second with which the times were counted, Hz; 0 if they are the recording's own.
  double counted_rate = 0;
  std::vector<ShotSlip> slips;  ///< corrected errors of the count
  /// Shots of a complete packet, if the file has one time for all rows of a packet and keeps the
  /// order of the rows, but not the places of missing ones; 0 in other formats. Times are then
  /// correct in complete packets.
  int packet_shots = 0;
  bool has_range = true;
  bool has_intensity = true;
  bool cartesian = false;  ///< records hold x, y, z and not angles
  /// The unit of coordinates or ranges is not stated: the likely one was assumed.
  bool length_unit_assumed = false;
  int returns_per_shot = 1;
  std::uint32_t frame_duration_ms = 50;
  /// Format-specific details needed to write the same bytes again in the same format (decimals,
  /// firmware type, ...), as name = value.
  std::vector<std::pair<std::string, std::string>> details;

  /// Value of a detail, or the fallback.
  std::string detail(const std::string& name, const std::string& fallback = {}) const;
  /// Value of a detail of one device, or nothing.
  std::string device_detail(const Device& device, const std::string& name) const;
  /// Replaces the value of a detail, or appends it to the others.
  void set_detail(const std::string& name, const std::string& value);
};

}  // namespace risley::recordings
