// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The command frame of Livox's second generation (Mid-360, HAP), and the lists of keys and values
// that most of its commands carry. All numbers are little-endian.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "risley/wire/address.hpp"
#include "risley/wire/frame.hpp"

namespace risley::wire {

/// Bytes before the data of a control frame.
inline constexpr std::size_t kControlHeaderBytes = 24;

/// Commands of the second generation.
enum class ControlCommand : std::uint16_t {
  search = 0x0000,         ///< which sensors are there?
  set = 0x0100,            ///< a list of keys and values
  get = 0x0101,            ///< a list of keys; the reply has their values
  push = 0x0102,           ///< a list that a sensor sends once a second
  reboot = 0x0200,         ///< after a delay
  factory_reset = 0x0201,  ///< all settings
  gps_time = 0x0202,       ///< of the last PPS edge
  log_data = 0x0300,       ///< a piece of a log
  log_switch = 0x0301,     ///< logs on and off
  log_time = 0x0302,       ///< of the host
  raw_data = 0x0303,       ///< other data on and off
};

/// A control frame without its transport fields.
struct ControlFrame {
  ControlCommand command = ControlCommand::search;
  bool reply = false;
  bool from_sensor = false;
  std::uint32_t sequence = 0;          ///< a reply repeats the number of its request
  std::span<const std::uint8_t> data;  ///< of the bytes that were decoded, or are to be encoded
};

/// The bytes of a frame. @throws InvalidArgument for more data than a frame can carry
std::vector<std::uint8_t> encode_control_frame(const ControlFrame& frame);

/// The frame at the beginning of a datagram; bytes may follow. Allocates no memory, whatever the
/// bytes are.
/// @return the frame, with its data a part of the bytes, or the reason why they are not a frame
std::variant<ControlFrame, FrameRefusal> decode_control_frame(std::span<const std::uint8_t> bytes);

/// Keys of a sensor's settings and state. Those from kSerialKey on can only be read.
inline constexpr std::uint16_t kDataTypeKey = 0x0000,  ///< of points, 1 byte
    kAddressKey = 0x0004,                              ///< address, mask and gateway
    kPushTargetKey = 0x0005,                           ///< HostTarget of pushes
    kPointTargetKey = 0x0006,                          ///< HostTarget of points
    kImuTargetKey = 0x0007,                            ///< HostTarget of inertial samples
    kAttitudeKey = 0x0012,                             ///< of installation, 24 bytes
    kViewKey = 0x0015,                                 ///< FieldOfView; that of the second follows
    kViewSwitchKey = 0x0017,                           ///< bits 0 and 1: which views count
    kTargetStateKey = 0x001A,                          ///< requested work state, 1 byte
    kImuSwitchKey = 0x001C,                            ///< inertial samples on, 1 byte
    kSerialKey = 0x8000,                               ///< 16 characters
    kFirmwareKey = 0x8002,                             ///< version, 4 bytes
    kStateKey = 0x8006,                                ///< work state, 1 byte
    kTemperatureKey = 0x8007,                          ///< of the core, 0.01 degrees Celsius
    kClockKey = 0x8009,                                ///< time of the sensor, ns
    kSyncKey = 0x800C,                                 ///< 0 none, 1 PTP, 2 GPS
    kDiagnosisKey = 0x800E,                            ///< SensorReport::diagnosis
    kFirmwareTypeKey = 0x8010,                         ///< 0 loader, 1 application
    kFaultsKey = 0x8011;                               ///< 8 of SensorReport::faults

/// Work states, as values of kStateKey and kTargetStateKey.
inline constexpr std::uint8_t kSamplingState = 1,  ///< it sends data
    kIdleState = 2,                                ///< nothing runs
    kStartingState = 6,                            ///< the motors start
    kReadyState = 9;                               ///< the motors run, the laser is off

/// Addresses on which a sensor listens and from which it sends. Several may be the same.
struct ControlPorts {
  std::uint16_t search = 56000, command = 56100, push = 56200, points = 56300, imu = 56400,
                log = 56500;
};
/// Of a type of sensors. @param device_type  as recordings::Device::type
ControlPorts control_ports(std::uint8_t device_type);
/// Port of hosts and sensors for searches.
inline constexpr std::uint16_t kSearchPort = ControlPorts{}.search;

/// One entry of a list.
struct KeyValue {
  std::uint16_t key = 0;
  std::span<const std::uint8_t> value;
};

/// The list in a frame: those of set and push, and of the reply to get. Unknown keys are entries
/// like others; a truncated list ends with its last complete entry. Empty for others.
std::vector<KeyValue> list_of(const ControlFrame& frame);
/// Data of a set or push with such a list.
std::vector<std::uint8_t> encode_list(std::span<const KeyValue> list);
/// Data of a get of these keys.
std::vector<std::uint8_t> encode_keys(std::span<const std::uint16_t> keys);
/// Data of the reply to a get. @param code  0 where it succeeded
std::vector<std::uint8_t> encode_list_reply(std::uint8_t code, std::span<const KeyValue> list);

/// What a sensor replies to a search.
struct SearchReply {
  std::uint8_t code = 0;         ///< 0 where it succeeded
  std::uint8_t device_type = 0;  ///< as recordings::Device::type
  std::string serial;
  Address address;
  std::uint16_t command_port = 0;
  friend bool operator==(const SearchReply&, const SearchReply&) = default;
};
/// Empty for other frames.
std::optional<SearchReply> search_reply_of(const ControlFrame& frame);
/// Data of it.
std::vector<std::uint8_t> encode_search_reply(const SearchReply& reply);

/// Destination of a sensor's data.
struct HostTarget {
  Address address;
  std::uint16_t host_port = 0, sensor_port = 0;
  friend bool operator==(const HostTarget&, const HostTarget&) = default;
};
/// Value of a target's key.
std::array<std::uint8_t, 8> encode_target(const HostTarget& target);
/// The inverse. @return empty for another length
std::optional<HostTarget> target_of(std::span<const std::uint8_t> value);

/// A part of the directions in which a sensor measures, degrees: yaw 0 to 360, pitch -10 to 60.
struct FieldOfView {
  std::int32_t yaw_start_deg = 0, yaw_stop_deg = 0, pitch_start_deg = 0, pitch_stop_deg = 0;
  friend bool operator==(const FieldOfView&, const FieldOfView&) = default;
};
/// Value of a view's key. @return empty for another length
std::optional<FieldOfView> view_of(std::span<const std::uint8_t> value);
/// The inverse.
std::array<std::uint8_t, 20> encode_view(const FieldOfView& view);

/// What a sensor says of itself. Empty: it did not.
struct SensorReport {
  std::optional<std::uint8_t> work_state;        ///< see work_state_words()
  std::optional<std::int32_t> temperature_cdeg;  ///< of the core, 0.01 degrees Celsius
  std::optional<std::uint8_t> sync;              ///< 0 none, 1 PTP, 2 GPS
  /// Four bits each, from the lowest on: system, scanner, ranging, communication; 0 good, 1
  /// warning, 2 error, 3 stopped for safety.
  std::optional<std::uint16_t> diagnosis;
  std::vector<std::uint32_t> faults =
      {};  ///< number << 16 | level: 1 info, 2 warning, 3 error, 4 fatal
  friend bool operator==(const SensorReport&, const SensorReport&) = default;
};
/// Applies the entries of a list; the rest stays unchanged.
void update_report(SensorReport& report, std::span<const KeyValue> list);
/// Problems, each in words: "scanner: warning", "fault 0104: error". Empty for a healthy sensor.
std::vector<std::string> trouble_words(const SensorReport& report);

/// "13.18.2.44" of the value of kFirmwareKey; empty for another length.
std::string version_text(std::span<const std::uint8_t> value);
/// A work state in words: "sampling"; "state 12" for undocumented ones.
std::string work_state_words(std::uint8_t state);

}  // namespace risley::wire
