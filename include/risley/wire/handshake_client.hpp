// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "risley/wire/client_session.hpp"

namespace risley::wire {

/// A session with a sensor of the first generation: a handshake binds it to this host, and
/// heartbeats maintain the binding.
class HandshakeClient final : public ClientSession {
 public:
  HandshakeClient(const ClientSettings& settings, std::int64_t now_ns);

 private:
  void ask_next(std::int64_t now_ns) override;
  void ask_for_the_end() override;
  std::vector<std::uint8_t> heartbeat(std::uint16_t sequence) override;
  void take(std::span<const std::uint8_t> datagram, std::int64_t now_ns) override;
  void take_message(const Frame& frame);
  void take_reply(const Frame& frame, std::int64_t now_ns);
  void note_heartbeat(const HeartbeatReply& reply);

  std::deque<Command> to_ask_;
  Command asked_;
  bool identified_ = false;
  std::optional<std::uint8_t> sensor_state_;
  std::optional<std::uint32_t> status_;
};

}  // namespace risley::wire
