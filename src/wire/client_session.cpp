// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/client_session.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

namespace risley::wire {

ClientSession::ClientSession(const ClientSettings& settings, std::int64_t now_ns)
    : settings_(settings), heard_ns_(now_ns) {
  ask(Handshake{settings.host, settings.data_port, settings.command_port, settings.data_port},
      now_ns);
}

void ClientSession::tell(ClientEvent::Kind kind, std::uint32_t value, std::string text) {
  events_.push_back({kind, value, std::move(text)});
}

void ClientSession::lose(std::string why) {
  state_ = ClientState::lost;
  pending_.reset();
  to_ask_.clear();
  tell(ClientEvent::Kind::lost, 0, std::move(why));
}

void ClientSession::ask(const Command& command, std::int64_t now_ns) {
  pending_ = command;
  pending_sequence_ = ++sequence_;
  send_pending(now_ns);
}

void ClientSession::send_pending(std::int64_t now_ns) {
  datagrams_.push_back(encode(*pending_, pending_sequence_));
  pending_sent_ns_ = now_ns;
}

void ClientSession::send_heartbeat(std::int64_t now_ns) {
  heartbeat_sequence_ = ++sequence_;
  heartbeat_open_ = true;
  datagrams_.push_back(encode(Command(Heartbeat{}), heartbeat_sequence_));
  heartbeat_due_ns_ = now_ns + kHeartbeatPeriod;
}

void ClientSession::advance(std::int64_t now_ns) {
  if (state_ == ClientState::closed || state_ == ClientState::lost) return;
  // While the caller stood still, nobody asked the sensor anything.
  heard_ns_ += std::max<std::int64_t>(now_ns - next_ns(), 0);
  if (now_ns - heard_ns_ >= kSilence) {
    lose(fmt::format("no reply for {:.1f} s", 1e-9 * static_cast<double>(now_ns - heard_ns_)));
    return;
  }
  if (pending_ && now_ns - pending_sent_ns_ >= kCommandTimeout) send_pending(now_ns);
  if (connected_ && now_ns >= heartbeat_due_ns_) send_heartbeat(now_ns);
  go_on(now_ns);
}

std::int64_t ClientSession::next_ns() const {
  if (state_ == ClientState::closed || state_ == ClientState::lost) {
    return std::numeric_limits<std::int64_t>::max();
  }
  std::int64_t next = heard_ns_ + kSilence;
  if (pending_) next = std::min(next, pending_sent_ns_ + kCommandTimeout);
  if (connected_) next = std::min(next, heartbeat_due_ns_);
  return next;
}

void ClientSession::stop(std::int64_t now_ns) {
  if (state_ == ClientState::closed || state_ == ClientState::lost ||
      state_ == ClientState::stopping) {
    return;
  }
  pending_.reset();
  to_ask_.clear();
  if (!connected_) {
    state_ = ClientState::closed;
    tell(ClientEvent::Kind::closed);
    return;
  }
  state_ = ClientState::stopping;
  to_ask_ = {SetSampling{0}, Disconnect{}};
  go_on(now_ns);
}

/// Asks what comes next, once the last command was answered.
void ClientSession::go_on(std::int64_t now_ns) {
  if (pending_) return;
  if (state_ == ClientState::connecting && identified_ &&
      sensor_state_ == static_cast<std::uint8_t>(SensorState::normal)) {
    state_ = ClientState::setting_up;
    if (settings_.spherical) {
      to_ask_.emplace_back(SetCoordinates{static_cast<std::uint8_t>(*settings_.spherical ? 1 : 0)});
    }
    if (settings_.return_mode) {
      to_ask_.emplace_back(SetReturnMode{static_cast<std::uint8_t>(*settings_.return_mode)});
    }
    if (settings_.imu) {
      to_ask_.emplace_back(SetImuRate{static_cast<std::uint8_t>(*settings_.imu ? 1 : 0)});
    }
    to_ask_.emplace_back(SetSampling{1});
  }
  if (to_ask_.empty()) return;
  const Command next = to_ask_.front();
  to_ask_.pop_front();
  ask(next, now_ns);
}

void ClientSession::receive(std::span<const std::uint8_t> datagram, std::int64_t now_ns) {
  if (state_ == ClientState::closed || state_ == ClientState::lost) return;
  const auto decoded = decode_frame(datagram);
  const Frame* frame = std::get_if<Frame>(&decoded);
  if (frame == nullptr) {
    ++rejected_;
  } else if (frame->type == FrameType::message) {
    const auto message = decode_message(*frame);
    const auto* known = std::get_if<Message>(&message);
    const auto* abnormal = known != nullptr ? std::get_if<AbnormalStatus>(known) : nullptr;
    if (abnormal == nullptr || !connected_) {
      ++rejected_;
    } else if (status_ != abnormal->status) {
      status_ = abnormal->status;
      tell(ClientEvent::Kind::status, abnormal->status);
    }
  } else if (frame->type == FrameType::reply) {
    take_reply(*frame, now_ns);
  } else {
    ++rejected_;
  }
}

void ClientSession::take_reply(const Frame& frame, std::int64_t now_ns) {
  const auto decoded = decode_reply(frame);
  const auto* reply = std::get_if<Reply>(&decoded);
  if (reply == nullptr) {
    ++rejected_;
    return;
  }
  if (const auto* heartbeat = std::get_if<HeartbeatReply>(reply)) {
    if (!heartbeat_open_ || frame.sequence != heartbeat_sequence_) {
      ++rejected_;
      return;
    }
    heartbeat_open_ = false;
    heard_ns_ = now_ns;
    note_heartbeat(*heartbeat);
    go_on(now_ns);
    return;
  }
  if (!pending_ || frame.sequence != pending_sequence_ || frame.command != command_id(*pending_)) {
    ++rejected_;
    return;
  }
  heard_ns_ = now_ns;
  const Command answered = *pending_;
  pending_.reset();
  const std::uint8_t result =
      std::visit([](const auto& value) -> std::uint8_t { return value.result; }, *reply);
  if (const auto* sampling = std::get_if<SetSampling>(&answered)) {
    if (sampling->value == 1 && result != 0) {
      lose("the sensor refuses to start");
      return;
    }
    if (sampling->value == 1) {
      state_ = ClientState::sampling;
      tell(ClientEvent::Kind::sampling);
    }
  } else if (std::holds_alternative<Handshake>(answered)) {
    if (result != 0) {
      lose("the sensor refuses the handshake");
      return;
    }
    connected_ = true;
    tell(ClientEvent::Kind::connected);
    to_ask_.emplace_back(QueryDeviceInfo{});
    send_heartbeat(now_ns);
  } else if (std::holds_alternative<Disconnect>(answered)) {
    state_ = ClientState::closed;
    tell(ClientEvent::Kind::closed);
  } else if (result != 0) {
    tell(ClientEvent::Kind::refused, 0, to_string(frame.command));
  }
  if (const auto* info = std::get_if<DeviceInfo>(reply)) {
    identified_ = true;
    tell(ClientEvent::Kind::firmware, 0, firmware_text(info->firmware));
  }
  go_on(now_ns);
}

void ClientSession::note_heartbeat(const HeartbeatReply& reply) {
  if (reply.result != 0) return;
  if (sensor_state_ != reply.state) {
    sensor_state_ = reply.state;
    tell(ClientEvent::Kind::sensor_state, reply.state);
  }
  const bool starting = reply.state == static_cast<std::uint8_t>(SensorState::starting);
  if (!starting && status_ != reply.status) {
    status_ = reply.status;
    tell(ClientEvent::Kind::status, reply.status);
  }
}

std::vector<std::vector<std::uint8_t>> ClientSession::take_datagrams() {
  return std::exchange(datagrams_, {});
}

std::vector<ClientEvent> ClientSession::take_events() { return std::exchange(events_, {}); }

}  // namespace risley::wire
