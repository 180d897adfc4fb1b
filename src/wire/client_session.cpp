// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/client_session.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

namespace risley::wire {

void ClientSession::notify(ClientEvent::Kind kind, std::uint32_t value, std::string text) {
  events_.push_back({kind, value, std::move(text)});
}

void ClientSession::notify(const SensorReport& report) {
  events_.push_back({ClientEvent::Kind::report, 0, {}, report});
}

void ClientSession::lose(std::string why) {
  state_ = ClientState::lost;
  pending_.reset();
  notify(ClientEvent::Kind::lost, 0, std::move(why));
}

void ClientSession::close() {
  state_ = ClientState::closed;
  notify(ClientEvent::Kind::closed);
}

void ClientSession::connect(std::int64_t now_ns) {
  connected_ = true;
  notify(ClientEvent::Kind::connected);
  send_heartbeat(now_ns);
}

void ClientSession::send(std::vector<std::uint8_t> request, std::uint16_t sequence,
                         std::int64_t now_ns) {
  datagrams_.push_back(request);
  pending_ = {sequence, std::move(request), now_ns};
}

void ClientSession::send_heartbeat(std::int64_t now_ns) {
  heartbeat_sequence_ = next_sequence();
  heartbeat_open_ = true;
  datagrams_.push_back(heartbeat(heartbeat_sequence_));
  heartbeat_due_ns_ = now_ns + heartbeat_period_ns_;
}

bool ClientSession::answers(std::uint16_t sequence, std::int64_t now_ns) {
  if (!pending_ || pending_->sequence != sequence) return false;
  pending_.reset();
  heard_ns_ = now_ns;
  return true;
}

bool ClientSession::answers_heartbeat(std::uint16_t sequence, std::int64_t now_ns) {
  if (!heartbeat_open_ || heartbeat_sequence_ != sequence) return false;
  heartbeat_open_ = false;
  heard_ns_ = now_ns;
  return true;
}

void ClientSession::go_on(std::int64_t now_ns) {
  if (!pending_ && !over()) ask_next(now_ns);
}

void ClientSession::advance(std::int64_t now_ns) {
  if (over()) return;
  // While the caller was suspended, the sensor got no requests.
  heard_ns_ += std::max<std::int64_t>(now_ns - next_ns(), 0);
  if (now_ns - heard_ns_ >= kSilence) {
    lose(fmt::format("no reply for {:.1f} s", 1e-9 * static_cast<double>(now_ns - heard_ns_)));
    return;
  }
  if (pending_ && now_ns - pending_->sent_ns >= kCommandTimeout) {
    datagrams_.push_back(pending_->bytes);
    pending_->sent_ns = now_ns;
  }
  if (connected_ && now_ns >= heartbeat_due_ns_) send_heartbeat(now_ns);
  go_on(now_ns);
}

std::int64_t ClientSession::next_ns() const {
  if (over()) return std::numeric_limits<std::int64_t>::max();
  std::int64_t next = heard_ns_ + kSilence;
  if (pending_) next = std::min(next, pending_->sent_ns + kCommandTimeout);
  if (connected_) next = std::min(next, heartbeat_due_ns_);
  return next;
}

void ClientSession::receive(std::span<const std::uint8_t> datagram, std::int64_t now_ns) {
  if (!over()) take(datagram, now_ns);
}

void ClientSession::stop(std::int64_t now_ns) {
  if (over() || state_ == ClientState::stopping) return;
  pending_.reset();
  if (!connected_) {
    close();
    return;
  }
  state_ = ClientState::stopping;
  ask_for_the_end();
  go_on(now_ns);
}

std::vector<std::vector<std::uint8_t>> ClientSession::take_datagrams() {
  return std::exchange(datagrams_, {});
}

std::vector<ClientEvent> ClientSession::take_events() { return std::exchange(events_, {}); }

}  // namespace risley::wire
