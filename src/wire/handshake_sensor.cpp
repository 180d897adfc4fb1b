// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/handshake_sensor.hpp"

#include <algorithm>
#include <utility>

namespace risley::wire {
namespace {

constexpr std::uint8_t kOk = 0, kFailed = 1;
/// Of a status: something is wrong.
constexpr unsigned kSystemAt = 30;
constexpr std::uint8_t kMostParameterValue = 1;

ResultReply result_of(const Command& command, bool ok) {
  return {command_id(command), ok ? kOk : kFailed};
}

}  // namespace

HandshakeSensor::HandshakeSensor(SensorIdentity identity, const SensorAbilities& abilities,
                                 std::int64_t now_ns)
    : SensorSession(std::move(identity)), abilities_(abilities), broadcast_due_ns_(now_ns) {
  if (abilities_.high_sensitivity) {
    parameters_[static_cast<std::uint16_t>(ParameterKey::high_sensitivity)] = 0;
  }
  if (abilities_.scan_pattern) {
    parameters_[static_cast<std::uint16_t>(ParameterKey::scan_pattern)] = 0;
  }
}

void HandshakeSensor::leave(std::int64_t now_ns) {
  connected_ = sampling_ = false;
  broadcast_due_ns_ = now_ns;
}

void HandshakeSensor::say(const std::optional<Endpoint>& to, std::vector<std::uint8_t> bytes) {
  datagrams_.push_back({kSensorPort, to, std::move(bytes)});
}

void HandshakeSensor::advance(std::int64_t now_ns) {
  if (connected_ && now_ns - heartbeat_ns_ >= kHeartbeatTimeout) leave(now_ns);
  if (!connected_ && now_ns >= broadcast_due_ns_) {
    say({}, encode(Message(Broadcast{identity().code, identity().device_type, abilities_.reserved}),
                   0));
    broadcast_due_ns_ = now_ns + kBroadcastPeriod;
  }
  if (connected_ && (status_ >> kSystemAt) != 0 && now_ns >= status_due_ns_) {
    say(Endpoint{data_target_.address, command_port_},
        encode(Message(AbnormalStatus{status_}), sequence_++));
    status_due_ns_ = now_ns + kStatusPeriod;
  }
}

std::int64_t HandshakeSensor::next_ns() const {
  if (!connected_) return broadcast_due_ns_;
  const std::int64_t timeout = heartbeat_ns_ + kHeartbeatTimeout;
  return (status_ >> kSystemAt) != 0 ? std::min(timeout, status_due_ns_) : timeout;
}

std::uint8_t HandshakeSensor::data_type() const {
  constexpr std::uint8_t kOneReturn = 2, kTwoReturns = 4, kThreeReturns = 7;
  const auto spherical = static_cast<std::uint8_t>(spherical_ ? 1 : 0);
  if (!abilities_.return_modes) return spherical;
  const std::uint8_t cartesian = return_mode_ == ReturnMode::triple ? kThreeReturns
                                 : return_mode_ == ReturnMode::dual ? kTwoReturns
                                                                    : kOneReturn;
  return static_cast<std::uint8_t>(cartesian + spherical);
}

void HandshakeSensor::receive(const Endpoint& from, std::uint16_t /*port*/,
                              std::span<const std::uint8_t> datagram, std::int64_t now_ns) {
  const auto decoded = decode_frame(datagram);
  const Frame* frame = std::get_if<Frame>(&decoded);
  // Clients send commands with the type of a reply, too.
  if (frame == nullptr || frame->type == FrameType::message) {
    ++rejected_;
    return;
  }
  const auto meaning = decode_command(*frame);
  const auto* command = std::get_if<Command>(&meaning);
  const auto* hand = command != nullptr ? std::get_if<Handshake>(command) : nullptr;
  const bool is_host = connected_ && data_target_.address == from.address;
  if (hand != nullptr && (is_host || !connected_)) {
    shake_hands(from, *hand, frame->sequence, now_ns);
    return;
  }
  if (!is_host) {
    ++rejected_;
    return;
  }
  const Endpoint to{from.address, command_port_};
  if (command == nullptr) {
    ++rejected_;
    if (std::get<DataFault>(meaning) != DataFault::unknown_command) {
      say(to, encode(Reply(ResultReply{frame->command, kFailed}), frame->sequence));
    }
    return;
  }
  if (const auto reply = obey(*command, now_ns)) say(to, encode(*reply, frame->sequence));
  if (std::holds_alternative<Disconnect>(*command)) leave(now_ns);
}

void HandshakeSensor::shake_hands(const Endpoint& from, const Handshake& hand,
                                  std::uint16_t sequence, std::int64_t now_ns) {
  const bool allowed = hand.host == from.address && hand.data_port != 0 && hand.command_port != 0;
  const Reply reply = result_of(hand, allowed);
  if (!allowed) {
    ++rejected_;
    say(from, encode(reply, sequence));
    return;
  }
  connected_ = true;
  command_port_ = hand.command_port;
  const std::uint16_t imu_port = hand.imu_port.value_or(hand.data_port);
  data_target_ = {from.address, hand.data_port};
  imu_target_ = {from.address, imu_port == 0 ? hand.data_port : imu_port};
  sampling_ = false;
  heartbeat_ns_ = now_ns;
  ++handshakes_;
  say(Endpoint{from.address, command_port_}, encode(reply, sequence));
}

std::uint8_t HandshakeSensor::set_return_mode(std::uint8_t mode) {
  const auto wanted = static_cast<ReturnMode>(mode);
  if (!abilities_.return_modes) return kFailed;
  if (wanted == ReturnMode::triple && !abilities_.triple) return kFailed;
  return_mode_ = wanted;
  return kOk;
}

ParametersReply HandshakeSensor::write(const WriteParameters& wanted) {
  for (const Parameter& parameter : wanted.parameters) {
    if (!parameters_.contains(parameter.key) || parameter.value.size() != 1 ||
        parameter.value[0] > kMostParameterValue) {
      return {WriteParameters::kId, kFailed, parameter.key, kFailed};
    }
  }
  for (const Parameter& parameter : wanted.parameters) {
    parameters_[parameter.key] = parameter.value[0];
  }
  return {WriteParameters::kId, kOk, 0, 0};
}

ParameterValues HandshakeSensor::read(const ReadParameters& wanted) const {
  ParameterValues values;
  for (const std::uint16_t key : wanted.keys) {
    const auto found = parameters_.find(key);
    if (found == parameters_.end()) return {kFailed, key, kFailed, {}};
    values.parameters.push_back({key, {found->second}});
  }
  return values;
}

ParametersReply HandshakeSensor::reset(const ResetParameters& wanted) {
  if (wanted.listed) {
    for (const std::uint16_t key : wanted.keys) {
      if (!parameters_.contains(key)) return {ResetParameters::kId, kFailed, key, kFailed};
    }
  }
  for (auto& [key, value] : parameters_) {
    if (!wanted.listed || std::ranges::find(wanted.keys, key) != wanted.keys.end()) {
      value = 0;
    }
  }
  return {ResetParameters::kId, kOk, 0, 0};
}

/// Executes a command of the host. @return what it is answered with
std::optional<Reply> HandshakeSensor::obey(const Command& command, std::int64_t now_ns) {
  return std::visit(
      [&](const auto& wanted) -> std::optional<Reply> {
        using Kind = std::remove_cvref_t<decltype(wanted)>;
        if constexpr (std::is_same_v<Kind, QueryDeviceInfo>) {
          return DeviceInfo{kOk, identity().firmware};
        } else if constexpr (std::is_same_v<Kind, Heartbeat>) {
          heartbeat_ns_ = now_ns;
          return HeartbeatReply{kOk, state_, static_cast<std::uint8_t>(rain_filter_ ? 1 : 0),
                                status_};
        } else if constexpr (std::is_same_v<Kind, SetSampling>) {
          const bool ready = state_ == static_cast<std::uint8_t>(SensorState::normal);
          if (wanted.value == 0 || ready) sampling_ = wanted.value == 1;
          return result_of(command, wanted.value == 0 || ready);
        } else if constexpr (std::is_same_v<Kind, SetCoordinates>) {
          spherical_ = wanted.value == 1;
          return result_of(command, true);
        } else if constexpr (std::is_same_v<Kind, SetMode>) {
          // The modes 1 to 3 are the states 1 to 3.
          state_ = wanted.value;
          if (state_ != static_cast<std::uint8_t>(SensorState::normal)) sampling_ = false;
          return result_of(command, true);
        } else if constexpr (std::is_same_v<Kind, SetReturnMode>) {
          return ResultReply{Kind::kId, set_return_mode(wanted.value)};
        } else if constexpr (std::is_same_v<Kind, QueryReturnMode>) {
          return ValueReply{Kind::kId, abilities_.return_modes ? kOk : kFailed,
                            static_cast<std::uint8_t>(return_mode_)};
        } else if constexpr (std::is_same_v<Kind, SetImuRate>) {
          const bool ok = abilities_.imu;
          if (ok) imu_ = wanted.value == 1;
          return result_of(command, ok);
        } else if constexpr (std::is_same_v<Kind, QueryImuRate>) {
          return ValueReply{Kind::kId, abilities_.imu ? kOk : kFailed,
                            static_cast<std::uint8_t>(imu_ ? 1 : 0)};
        } else if constexpr (std::is_same_v<Kind, SetRainFilter>) {
          rain_filter_ = wanted.value == 1;
          return result_of(command, true);
        } else if constexpr (std::is_same_v<Kind, SetFan>) {
          fan_ = wanted.value == 1;
          return result_of(command, true);
        } else if constexpr (std::is_same_v<Kind, QueryFan>) {
          return ValueReply{Kind::kId, kOk, static_cast<std::uint8_t>(fan_ ? 1 : 0)};
        } else if constexpr (std::is_same_v<Kind, WriteExtrinsics>) {
          extrinsics_ = wanted.extrinsics;
          return result_of(command, true);
        } else if constexpr (std::is_same_v<Kind, ReadExtrinsics>) {
          return ExtrinsicsReply{kOk, extrinsics_};
        } else if constexpr (std::is_same_v<Kind, WriteParameters>) {
          return write(wanted);
        } else if constexpr (std::is_same_v<Kind, ReadParameters>) {
          return read(wanted);
        } else if constexpr (std::is_same_v<Kind, ResetParameters>) {
          return reset(wanted);
        } else if constexpr (std::is_same_v<Kind, QueryAddress>) {
          return AddressReply{kOk, true, identity().address, {}, {}};
        } else if constexpr (std::is_same_v<Kind, Reboot>) {
          reboot_ = std::int64_t{wanted.delay_ms} * 1'000'000;
          return result_of(command, true);
        } else if constexpr (std::is_same_v<Kind, SetAddress> || std::is_same_v<Kind, SetUtc>) {
          // Its address is the one with which it was started, and it has its own clock.
          return result_of(command, false);
        } else if constexpr (std::is_same_v<Kind, Disconnect>) {
          return result_of(command, true);
        } else {
          static_assert(std::is_same_v<Kind, Handshake>);
          return std::nullopt;  // shake_hands() has answered
        }
      },
      command);
}

}  // namespace risley::wire
