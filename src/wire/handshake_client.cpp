// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/handshake_client.hpp"

#include <utility>

namespace risley::wire {

HandshakeClient::HandshakeClient(const ClientSettings& settings, std::int64_t now_ns)
    : ClientSession(settings, now_ns) {
  to_ask_.emplace_back(
      Handshake{settings.host, settings.data_port, settings.command_port, settings.data_port});
  go_on(now_ns);
}

std::vector<std::uint8_t> HandshakeClient::heartbeat(std::uint16_t sequence) {
  return encode(Command(Heartbeat{}), sequence);
}

void HandshakeClient::ask_for_the_end() { to_ask_ = {SetSampling{0}, Disconnect{}}; }

void HandshakeClient::ask_next(std::int64_t now_ns) {
  if (state() == ClientState::connecting && identified_ &&
      sensor_state_ == static_cast<std::uint8_t>(SensorState::normal)) {
    set_state(ClientState::setting_up);
    if (settings().spherical) {
      to_ask_.emplace_back(
          SetCoordinates{static_cast<std::uint8_t>(*settings().spherical ? 1 : 0)});
    }
    if (settings().return_mode) {
      to_ask_.emplace_back(SetReturnMode{static_cast<std::uint8_t>(*settings().return_mode)});
    }
    if (settings().imu) {
      to_ask_.emplace_back(SetImuRate{static_cast<std::uint8_t>(*settings().imu ? 1 : 0)});
    }
    to_ask_.emplace_back(SetSampling{1});
  }
  if (to_ask_.empty()) return;
  asked_ = to_ask_.front();
  to_ask_.pop_front();
  const std::uint16_t sequence = next_sequence();
  send(encode(asked_, sequence), sequence, now_ns);
}

void HandshakeClient::take(std::span<const std::uint8_t> datagram, std::int64_t now_ns) {
  const auto decoded = decode_frame(datagram);
  const Frame* frame = std::get_if<Frame>(&decoded);
  if (frame != nullptr && frame->type == FrameType::message) {
    take_message(*frame);
  } else if (frame != nullptr && frame->type == FrameType::reply) {
    take_reply(*frame, now_ns);
  } else {
    reject();
  }
}

void HandshakeClient::take_message(const Frame& frame) {
  const auto message = decode_message(frame);
  const auto* known = std::get_if<Message>(&message);
  const auto* abnormal = known != nullptr ? std::get_if<AbnormalStatus>(known) : nullptr;
  if (abnormal == nullptr || !connected()) {
    reject();
  } else if (status_ != abnormal->status) {
    status_ = abnormal->status;
    notify(ClientEvent::Kind::status, abnormal->status);
  }
}

void HandshakeClient::take_reply(const Frame& frame, std::int64_t now_ns) {
  const auto decoded = decode_reply(frame);
  const auto* reply = std::get_if<Reply>(&decoded);
  if (reply == nullptr) {
    reject();
    return;
  }
  if (const auto* heartbeat = std::get_if<HeartbeatReply>(reply)) {
    if (!answers_heartbeat(frame.sequence, now_ns)) {
      reject();
      return;
    }
    note_heartbeat(*heartbeat);
    go_on(now_ns);
    return;
  }
  if (frame.command != command_id(asked_) || !answers(frame.sequence, now_ns)) {
    reject();
    return;
  }
  const std::uint8_t result =
      std::visit([](const auto& value) -> std::uint8_t { return value.result; }, *reply);
  if (const auto* sampling = std::get_if<SetSampling>(&asked_)) {
    if (sampling->value == 1 && result != 0) {
      lose("the sensor refuses to start");
      return;
    }
    if (sampling->value == 1) {
      set_state(ClientState::sampling);
      notify(ClientEvent::Kind::sampling);
    }
  } else if (std::holds_alternative<Handshake>(asked_)) {
    if (result != 0) {
      lose("the sensor refuses the handshake");
      return;
    }
    to_ask_.emplace_back(QueryDeviceInfo{});
    connect(now_ns);
  } else if (std::holds_alternative<Disconnect>(asked_)) {
    close();
  } else if (result != 0) {
    notify(ClientEvent::Kind::refused, 0, to_string(frame.command));
  }
  if (const auto* info = std::get_if<DeviceInfo>(reply)) {
    identified_ = true;
    notify(ClientEvent::Kind::firmware, 0, firmware_text(info->firmware));
  }
  go_on(now_ns);
}

void HandshakeClient::note_heartbeat(const HeartbeatReply& reply) {
  if (reply.result != 0) return;
  if (sensor_state_ != reply.state) {
    sensor_state_ = reply.state;
    notify(ClientEvent::Kind::sensor_state, reply.state);
  }
  const bool starting = reply.state == static_cast<std::uint8_t>(SensorState::starting);
  if (!starting && status_ != reply.status) {
    status_ = reply.status;
    notify(ClientEvent::Kind::status, reply.status);
  }
}

}  // namespace risley::wire
