// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Contents of command frames, as typed values. A result of 0 is success, 1 a failure.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "risley/wire/address.hpp"
#include "risley/wire/frame.hpp"

namespace risley::wire {

// Messages that a sensor sends on its own.

/// Announces the sensor, about once a second until a host shakes hands.
struct Broadcast {
  static constexpr CommandId kId{0, 0x00};  ///< of its frames
  std::string code;              ///< broadcast code, at most 15 characters: "0TFDG3B006H2Z11"
  std::uint8_t device_type = 0;  ///< as recordings::Device::type
  std::uint16_t reserved = 0;    ///< 0, or 65000 from an Avia
  friend bool operator==(const Broadcast&, const Broadcast&) = default;
};

/// A fault of the sensor.
struct AbnormalStatus {
  static constexpr CommandId kId{0, 0x07};  ///< of its frames
  std::uint32_t status = 0;                 ///< as recordings::Packet::status
  friend bool operator==(const AbnormalStatus&, const AbnormalStatus&) = default;
};

// Commands of a host.

/// Binds the sensor to a host.
struct Handshake {
  static constexpr CommandId kId{0, 0x01};  ///< of its frames
  Address host;
  std::uint16_t data_port = 0, command_port = 0;
  std::optional<std::uint16_t> imu_port;  ///< early clients do not send it
  friend bool operator==(const Handshake&, const Handshake&) = default;
};

/// A command without data. @tparam kSet, kCommand  its id
template <std::uint8_t kSet, std::uint8_t kCommand>
struct PlainCommand {
  static constexpr CommandId kId{kSet, kCommand};  ///< of its frames
  friend bool operator==(const PlainCommand&, const PlainCommand&) = default;
};
using QueryDeviceInfo = PlainCommand<0, 0x02>;  ///< answered by DeviceInfo
using Heartbeat = PlainCommand<0, 0x03>;        ///< answered by HeartbeatReply
using Disconnect = PlainCommand<0, 0x06>;       ///< ends the session
using QueryAddress = PlainCommand<0, 0x09>;     ///< answered by AddressReply
using ReadExtrinsics = PlainCommand<1, 0x02>;   ///< answered by ExtrinsicsReply
using QueryFan = PlainCommand<1, 0x05>;         ///< answered by ValueReply
using QueryReturnMode = PlainCommand<1, 0x07>;  ///< answered by ValueReply
using QueryImuRate = PlainCommand<1, 0x09>;     ///< answered by ValueReply

/// A command with one byte of data. @tparam kMost, kLeast allowed values
template <std::uint8_t kSet, std::uint8_t kCommand, std::uint8_t kMost, std::uint8_t kLeast = 0>
struct ByteCommand {
  static constexpr CommandId kId{kSet, kCommand};      ///< of its frames
  static constexpr std::uint8_t kLeastValue = kLeast,  ///< that is allowed
      kMostValue = kMost;                              ///< that is allowed
  std::uint8_t value = kLeast;
  friend bool operator==(const ByteCommand&, const ByteCommand&) = default;
};
using SetSampling = ByteCommand<0, 0x04, 1>;     ///< 1 starts, 0 stops the data
using SetCoordinates = ByteCommand<0, 0x05, 1>;  ///< 0 Cartesian, 1 spherical
using SetMode = ByteCommand<1, 0x00, 3, 1>;      ///< 1 normal, 2 power saving, 3 standby
using SetRainFilter = ByteCommand<1, 0x03, 1>;   ///< against rain and fog
using SetFan = ByteCommand<1, 0x04, 1>;          ///< 1 on
using SetReturnMode = ByteCommand<1, 0x06, 3>;   ///< see ReturnMode
using SetImuRate = ByteCommand<1, 0x08, 1>;      ///< 0 off, 1 200 Hz

/// Values of SetReturnMode.
enum class ReturnMode : std::uint8_t { first = 0, strongest = 1, dual = 2, triple = 3 };

/// Sets the sensor's address from the next start on.
struct SetAddress {
  static constexpr CommandId kId{0, 0x08};  ///< of its frames
  bool is_static = false;
  Address address;
  std::optional<Address> mask, gateway;  ///< of newer firmware: both or none
  friend bool operator==(const SetAddress&, const SetAddress&) = default;
};

/// Starts the sensor again.
struct Reboot {
  static constexpr CommandId kId{0, 0x0A};  ///< of its frames
  std::uint16_t delay_ms = 0;
  friend bool operator==(const Reboot&, const Reboot&) = default;
};

/// Keys of Parameter.
enum class ParameterKey : std::uint16_t { high_sensitivity = 1, scan_pattern = 2, slot = 3 };

/// A parameter of the sensor with its value.
struct Parameter {
  std::uint16_t key = 0;  ///< a ParameterKey, or an unknown one
  std::vector<std::uint8_t> value;
  friend bool operator==(const Parameter&, const Parameter&) = default;
};

/// Sets parameters. Each has the length of its value, as in the manufacturer's SDK.
struct WriteParameters {
  static constexpr CommandId kId{0, 0x0B};  ///< of its frames
  std::vector<Parameter> parameters;
  friend bool operator==(const WriteParameters&, const WriteParameters&) = default;
};

/// Asks for parameters.
struct ReadParameters {
  static constexpr CommandId kId{0, 0x0C};  ///< of its frames
  std::vector<std::uint16_t> keys;          ///< at most 255
  friend bool operator==(const ReadParameters&, const ReadParameters&) = default;
};

/// Sets parameters back.
struct ResetParameters {
  static constexpr CommandId kId{0, 0x0D};  ///< of its frames
  bool listed = false;                      ///< only for keys; otherwise all
  std::vector<std::uint16_t> keys;          ///< at most 255
  friend bool operator==(const ResetParameters&, const ResetParameters&) = default;
};

/// Pose of the sensor, stored for other programs: deg and mm.
struct Extrinsics {
  std::array<float, 3> roll_pitch_yaw_deg{};
  std::array<std::int32_t, 3> translation_mm{};
  friend bool operator==(const Extrinsics&, const Extrinsics&) = default;
};

/// Stores the pose.
struct WriteExtrinsics {
  static constexpr CommandId kId{1, 0x01};  ///< of its frames
  Extrinsics extrinsics;
  friend bool operator==(const WriteExtrinsics&, const WriteExtrinsics&) = default;
};

/// Sets the hour of the last PPS edge.
struct SetUtc {
  static constexpr CommandId kId{1, 0x0A};  ///< of its frames
  std::uint8_t year = 0;                    ///< since 2000
  std::uint8_t month = 1, day = 1, hour = 0;
  std::uint32_t microseconds = 0;  ///< of the hour
  friend bool operator==(const SetUtc&, const SetUtc&) = default;
};

// Replies of a sensor.

/// The reply to commands that request nothing.
struct ResultReply {
  CommandId command;        ///< that is answered
  std::uint8_t result = 0;  ///< 2: SetMode is being carried out
  friend bool operator==(const ResultReply&, const ResultReply&) = default;
};

/// Firmware of the sensor.
struct DeviceInfo {
  static constexpr CommandId kId{0, 0x02};  ///< of its frames
  std::uint8_t result = 0;
  std::array<std::uint8_t, 4> firmware{};
  friend bool operator==(const DeviceInfo&, const DeviceInfo&) = default;
};

/// "03.08.0000": a firmware as its maker writes it.
std::string firmware_text(const std::array<std::uint8_t, 4>& firmware);

/// States of a sensor.
enum class SensorState : std::uint8_t { starting = 0, normal, power_saving, standby, error };

/// How the sensor is.
struct HeartbeatReply {
  static constexpr CommandId kId{0, 0x03};  ///< of its frames
  std::uint8_t result = 0;
  std::uint8_t state = 1;    ///< a SensorState
  std::uint8_t feature = 0;  ///< bit 0: filter against rain and fog
  std::uint32_t status = 0;  ///< while starting: its progress in percent
  friend bool operator==(const HeartbeatReply&, const HeartbeatReply&) = default;
};

/// Address of the sensor.
struct AddressReply {
  static constexpr CommandId kId{0, 0x09};  ///< of its frames
  std::uint8_t result = 0;
  bool is_static = false;
  Address address;
  std::optional<Address> mask, gateway;  ///< of newer firmware: both or none
  friend bool operator==(const AddressReply&, const AddressReply&) = default;
};

/// The reply to WriteParameters and ResetParameters.
struct ParametersReply {
  CommandId command;  ///< that is answered
  std::uint8_t result = 0;
  std::uint16_t failing_key = 0;
  std::uint8_t error = 0;
  friend bool operator==(const ParametersReply&, const ParametersReply&) = default;
};

/// The reply to ReadParameters.
struct ParameterValues {
  static constexpr CommandId kId{0, 0x0C};  ///< of its frames
  std::uint8_t result = 0;
  std::uint16_t failing_key = 0;
  std::uint8_t error = 0;
  std::vector<Parameter> parameters;
  friend bool operator==(const ParameterValues&, const ParameterValues&) = default;
};

/// The reply to ReadExtrinsics.
struct ExtrinsicsReply {
  static constexpr CommandId kId{1, 0x02};  ///< of its frames
  std::uint8_t result = 0;
  Extrinsics extrinsics;
  friend bool operator==(const ExtrinsicsReply&, const ExtrinsicsReply&) = default;
};

/// The reply to QueryFan, QueryReturnMode and QueryImuRate.
struct ValueReply {
  CommandId command;  ///< that is answered
  std::uint8_t result = 0, value = 0;
  friend bool operator==(const ValueReply&, const ValueReply&) = default;
};

/// Unsolicited messages of a sensor.
using Message = std::variant<Broadcast, AbnormalStatus>;
/// What a host asks of a sensor.
using Command =
    std::variant<Handshake, QueryDeviceInfo, Heartbeat, SetSampling, SetCoordinates, Disconnect,
                 SetAddress, QueryAddress, Reboot, WriteParameters, ReadParameters, ResetParameters,
                 SetMode, WriteExtrinsics, ReadExtrinsics, SetRainFilter, SetFan, QueryFan,
                 SetReturnMode, QueryReturnMode, SetImuRate, QueryImuRate, SetUtc>;
/// What a sensor answers.
using Reply = std::variant<ResultReply, DeviceInfo, HeartbeatReply, AddressReply, ParametersReply,
                           ParameterValues, ExtrinsicsReply, ValueReply>;

/// The id of a command.
CommandId command_id(const Command& command);
/// The id of the answered command.
CommandId command_id(const Reply& reply);
/// "handshake", "set 1 command 77": name of a command in messages.
std::string to_string(CommandId command);

/// The bytes of a datagram. @throws InvalidArgument for texts and lists that are too long
std::vector<std::uint8_t> encode(const Message& message, std::uint16_t sequence);
/// As above, and for values that the command does not have.
std::vector<std::uint8_t> encode(const Command& command, std::uint16_t sequence);
/// As above. @param sequence  of the command
std::vector<std::uint8_t> encode(const Reply& reply, std::uint16_t sequence);

/// Reason why the data of a frame are invalid.
enum class DataFault : std::uint8_t {
  unknown_command,  ///< or one that does not go in this direction
  length,           ///< too few or too many data
  value,            ///< one that the command does not have
};
/// "unknown command", "wrong length of the data", "a value that the command does not have"
std::string to_string(DataFault fault);

// What frames mean. Replies are matched by the command that they answer; the caller checks the
// frame's type, because real clients send commands as replies.
std::variant<Message, DataFault> decode_message(const Frame& frame);  ///< of a sensor
std::variant<Command, DataFault> decode_command(const Frame& frame);  ///< of a host
std::variant<Reply, DataFault> decode_reply(const Frame& frame);      ///< of a sensor

}  // namespace risley::wire
