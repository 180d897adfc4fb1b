// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/commands.hpp"

#include <algorithm>
#include <concepts>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"

namespace risley::wire {
namespace {

constexpr std::size_t kCodeBytes = 16;  // with at least one NUL
constexpr std::size_t kMostKeys = 255;

/// Appends fields to data.
class DataWriter {
 public:
  template <class T>
  void number(T value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    io::store<T>(&bytes_[at], value);
  }
  void flag(bool value) { number<std::uint8_t>(value ? 1 : 0); }
  void choice(std::uint8_t value, std::uint8_t least, std::uint8_t most) {
    if (value < least || value > most) {
      throw InvalidArgument(
          fmt::format("value of a command = {}, allowed {} to {}", value, least, most));
    }
    number(value);
  }
  void address(const Address& value) {
    bytes_.insert(bytes_.end(), value.bytes.begin(), value.bytes.end());
  }
  void code(const std::string& text) {
    if (text.size() >= kCodeBytes) {
      throw InvalidArgument(
          fmt::format("broadcast code \"{}\" has {} characters, allowed at most {}", text,
                      text.size(), kCodeBytes - 1));
    }
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.resize(bytes_.size() + kCodeBytes - text.size());
  }
  void optional_number(const std::optional<std::uint16_t>& value) {
    if (value) number(*value);
  }
  void optional_addresses(const std::optional<Address>& first,
                          const std::optional<Address>& second) {
    if (first.has_value() != second.has_value()) {
      throw InvalidArgument("a mask without a gateway or a gateway without a mask");
    }
    if (!first) return;
    address(*first);
    address(*second);
  }
  void keys(const std::vector<std::uint16_t>& list) {
    if (list.size() > kMostKeys) {
      throw InvalidArgument(
          fmt::format("{} keys in a command, allowed at most {}", list.size(), kMostKeys));
    }
    number(static_cast<std::uint8_t>(list.size()));
    for (const std::uint16_t key : list) number(key);
  }
  void parameters(const std::vector<Parameter>& list) {
    for (const Parameter& parameter : list) {
      number(parameter.key);
      number(static_cast<std::uint16_t>(std::min<std::size_t>(parameter.value.size(), 0xFFFF)));
      bytes_.insert(bytes_.end(), parameter.value.begin(), parameter.value.end());
    }
  }

  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Reads fields from data; remembers the first fault and returns zeros after it.
class DataReader {
 public:
  explicit DataReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <class T>
  void number(T& value) {
    value = take(sizeof(T)) ? io::load<T>(&bytes_[at_ - sizeof(T)]) : T{};
  }
  void flag(bool& value) {
    std::uint8_t byte = 0;
    choice(byte, 0, 1);
    value = byte == 1;
  }
  void choice(std::uint8_t& value, std::uint8_t least, std::uint8_t most) {
    number(value);
    if (value < least || value > most) fail(DataFault::value);
  }
  void address(Address& value) {
    for (std::uint8_t& byte : value.bytes) number(byte);
  }
  void code(std::string& text) {
    if (!take(kCodeBytes)) return;
    const auto field = bytes_.subspan(at_ - kCodeBytes, kCodeBytes);
    const auto end = std::ranges::find(field, std::uint8_t{0});
    // A name of a device is plain text.
    const bool plain = end != field.end() && end != field.begin() &&
                       std::all_of(field.begin(), end,
                                   [](std::uint8_t byte) { return byte > 0x20 && byte < 0x7F; });
    if (!plain) {
      fail(DataFault::value);
    } else {
      text.assign(field.begin(), end);
    }
  }
  void optional_number(std::optional<std::uint16_t>& value) {
    value.reset();
    if (at_ < bytes_.size()) number(value.emplace());
  }
  void optional_addresses(std::optional<Address>& first, std::optional<Address>& second) {
    if (at_ == bytes_.size()) return;
    address(first.emplace());
    address(second.emplace());
  }
  void keys(std::vector<std::uint16_t>& list) {
    std::uint8_t count = 0;
    number(count);
    if (bytes_.size() - at_ < std::size_t{count} * 2) fail(DataFault::length);
    if (failed_) return;
    list.resize(count);
    for (std::uint16_t& key : list) number(key);
  }
  void parameters(std::vector<Parameter>& list) {
    while (at_ < bytes_.size() && !failed_) {
      Parameter parameter;
      std::uint16_t length = 0;
      number(parameter.key);
      number(length);
      if (!take(length)) return;
      const auto value = bytes_.subspan(at_ - length, length);
      parameter.value.assign(value.begin(), value.end());
      list.push_back(std::move(parameter));
    }
  }

  /// Whether there was an error, or data remain.
  bool failed() const { return failed_ || at_ != bytes_.size(); }
  /// The first fault.
  DataFault fault() const { return fault_; }

 private:
  bool take(std::size_t count) {
    if (bytes_.size() - at_ < count) fail(DataFault::length);
    if (failed_) return false;
    at_ += count;
    return true;
  }
  void fail(DataFault fault) {
    if (!failed_) fault_ = fault;
    failed_ = true;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool failed_ = false;
  DataFault fault_ = DataFault::length;
};

// The fields of every value in order, for both directions.

template <class T, class Value>
concept Is = std::same_as<std::remove_const_t<T>, Value>;
template <class T>
concept OneByte = requires {
  T::kMostValue;
};

void visit(auto& data, Is<Broadcast> auto& value) {
  data.code(value.code);
  data.number(value.device_type);
  data.number(value.reserved);
}
void visit(auto& data, Is<AbnormalStatus> auto& value) { data.number(value.status); }
void visit(auto& data, Is<Handshake> auto& value) {
  data.address(value.host);
  data.number(value.data_port);
  data.number(value.command_port);
  data.optional_number(value.imu_port);
}
template <std::uint8_t kSet, std::uint8_t kCommand>
void visit(auto& /*data*/, const PlainCommand<kSet, kCommand>& /*value*/) {}
void visit(auto& data, OneByte auto& value) {
  data.choice(value.value, value.kLeastValue, value.kMostValue);
}
void visit(auto& data, Is<SetAddress> auto& value) {
  data.flag(value.is_static);
  data.address(value.address);
  data.optional_addresses(value.mask, value.gateway);
}
void visit(auto& data, Is<Reboot> auto& value) { data.number(value.delay_ms); }
void visit(auto& data, Is<WriteParameters> auto& value) { data.parameters(value.parameters); }
void visit(auto& data, Is<ReadParameters> auto& value) { data.keys(value.keys); }
void visit(auto& data, Is<ResetParameters> auto& value) {
  data.flag(value.listed);
  data.keys(value.keys);
}
void visit(auto& data, Is<Extrinsics> auto& value) {
  for (auto& angle : value.roll_pitch_yaw_deg) data.number(angle);
  for (auto& distance : value.translation_mm) data.number(distance);
}
void visit(auto& data, Is<WriteExtrinsics> auto& value) { visit(data, value.extrinsics); }
void visit(auto& data, Is<SetUtc> auto& value) {
  data.number(value.year);
  data.number(value.month);
  data.number(value.day);
  data.number(value.hour);
  data.number(value.microseconds);
}
void visit(auto& data, Is<ResultReply> auto& value) { data.number(value.result); }
void visit(auto& data, Is<DeviceInfo> auto& value) {
  data.number(value.result);
  for (auto& byte : value.firmware) data.number(byte);
}
void visit(auto& data, Is<HeartbeatReply> auto& value) {
  data.number(value.result);
  data.number(value.state);
  data.number(value.feature);
  data.number(value.status);
}
void visit(auto& data, Is<AddressReply> auto& value) {
  data.number(value.result);
  data.flag(value.is_static);
  data.address(value.address);
  data.optional_addresses(value.mask, value.gateway);
}
void visit(auto& data, Is<ParametersReply> auto& value) {
  data.number(value.result);
  data.number(value.failing_key);
  data.number(value.error);
}
void visit(auto& data, Is<ParameterValues> auto& value) {
  data.number(value.result);
  data.number(value.failing_key);
  data.number(value.error);
  data.parameters(value.parameters);
}
void visit(auto& data, Is<ExtrinsicsReply> auto& value) {
  data.number(value.result);
  visit(data, value.extrinsics);
}
void visit(auto& data, Is<ValueReply> auto& value) {
  data.number(value.result);
  data.number(value.value);
}

template <class T>
concept AnswersOne = requires {
  T::kId;
};

template <class Value>
CommandId id_of(const Value& value) {
  if constexpr (AnswersOne<Value>) {
    return Value::kId;
  } else {
    return value.command;
  }
}

std::vector<std::uint8_t> encode_as(FrameType type, const auto& any, std::uint16_t sequence) {
  return std::visit(
      [&](const auto& value) {
        DataWriter data;
        visit(data, value);
        return encode_frame({type, sequence, id_of(value), data.bytes()});
      },
      any);
}

/// Reads the data of a frame into a value, whose id is already set.
template <class Any, class Value>
std::variant<Any, DataFault> decode_as(const Frame& frame, Value value) {
  DataReader data(frame.data);
  visit(data, value);
  if (data.failed()) return data.fault();
  return Any(std::move(value));
}

/// Of the alternatives for commands or replies, the one with the frame's id.
template <class Any, std::size_t kAlternative = 0>
std::variant<Any, DataFault> decode_any(const Frame& frame) {
  if constexpr (kAlternative == std::variant_size_v<Any>) {
    return DataFault::unknown_command;
  } else {
    using Value = std::variant_alternative_t<kAlternative, Any>;
    if constexpr (AnswersOne<Value>) {
      if (frame.command == Value::kId) return decode_as<Any>(frame, Value{});
    }
    return decode_any<Any, kAlternative + 1>(frame);
  }
}

constexpr CommandId kAnsweredByValue[] = {QueryFan::kId, QueryReturnMode::kId, QueryImuRate::kId};
constexpr CommandId kAnsweredByKey[] = {WriteParameters::kId, ResetParameters::kId};
constexpr CommandId kAnsweredByResult[] = {
    Handshake::kId,     SetSampling::kId, SetCoordinates::kId,  Disconnect::kId,    SetAddress::kId,
    Reboot::kId,        SetMode::kId,     WriteExtrinsics::kId, SetRainFilter::kId, SetFan::kId,
    SetReturnMode::kId, SetImuRate::kId,  SetUtc::kId,
};

bool is_among(std::span<const CommandId> list, CommandId command) {
  return std::ranges::find(list, command) != list.end();
}

struct CommandName {
  CommandId command;
  const char* name;
};
constexpr CommandName kNames[] = {
    {Broadcast::kId, "broadcast"},
    {AbnormalStatus::kId, "abnormal status"},
    {Handshake::kId, "handshake"},
    {QueryDeviceInfo::kId, "device info"},
    {Heartbeat::kId, "heartbeat"},
    {SetSampling::kId, "sampling"},
    {SetCoordinates::kId, "coordinates"},
    {Disconnect::kId, "disconnect"},
    {SetAddress::kId, "set address"},
    {QueryAddress::kId, "get address"},
    {Reboot::kId, "reboot"},
    {WriteParameters::kId, "write parameters"},
    {ReadParameters::kId, "read parameters"},
    {ResetParameters::kId, "reset parameters"},
    {SetMode::kId, "mode"},
    {WriteExtrinsics::kId, "write extrinsics"},
    {ReadExtrinsics::kId, "read extrinsics"},
    {SetRainFilter::kId, "rain filter"},
    {SetFan::kId, "fan"},
    {QueryFan::kId, "get fan"},
    {SetReturnMode::kId, "return mode"},
    {QueryReturnMode::kId, "get return mode"},
    {SetImuRate::kId, "inertial rate"},
    {QueryImuRate::kId, "get inertial rate"},
    {SetUtc::kId, "UTC"},
};

}  // namespace

std::string firmware_text(const std::array<std::uint8_t, 4>& firmware) {
  return fmt::format("{:02}.{:02}.{:02}{:02}", firmware[0], firmware[1], firmware[2], firmware[3]);
}

CommandId command_id(const Command& command) {
  return std::visit([](const auto& value) { return id_of(value); }, command);
}

CommandId command_id(const Reply& reply) {
  return std::visit([](const auto& value) { return id_of(value); }, reply);
}

std::string to_string(CommandId command) {
  for (const CommandName& known : kNames) {
    if (known.command == command) return known.name;
  }
  return fmt::format("set {} command {}", command.set, command.id);
}

std::string to_string(DataFault fault) {
  switch (fault) {
    case DataFault::unknown_command:
      return "unknown command";
    case DataFault::length:
      return "wrong length of the data";
    case DataFault::value:
      return "a value that the command does not have";
  }
  return {};
}

std::vector<std::uint8_t> encode(const Message& message, std::uint16_t sequence) {
  return encode_as(FrameType::message, message, sequence);
}

std::vector<std::uint8_t> encode(const Command& command, std::uint16_t sequence) {
  return encode_as(FrameType::command, command, sequence);
}

std::vector<std::uint8_t> encode(const Reply& reply, std::uint16_t sequence) {
  return encode_as(FrameType::reply, reply, sequence);
}

std::variant<Message, DataFault> decode_message(const Frame& frame) {
  return decode_any<Message>(frame);
}

std::variant<Command, DataFault> decode_command(const Frame& frame) {
  return decode_any<Command>(frame);
}

std::variant<Reply, DataFault> decode_reply(const Frame& frame) {
  const CommandId command = frame.command;
  if (is_among(kAnsweredByResult, command)) {
    return decode_as<Reply>(frame, ResultReply{command});
  }
  if (is_among(kAnsweredByKey, command)) {
    return decode_as<Reply>(frame, ParametersReply{command});
  }
  if (is_among(kAnsweredByValue, command)) return decode_as<Reply>(frame, ValueReply{command});
  return decode_any<Reply>(frame);
}

}  // namespace risley::wire
