// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The host's side of a session with one sensor, without sockets and clocks: time and datagrams in,
// datagrams and events out.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "risley/wire/commands.hpp"

namespace risley::wire {

/// What a host asks of a sensor, and where it listens.
struct ClientSettings {
  Address host;
  std::uint16_t data_port = 0, command_port = 0;  ///< inertial samples go to the data port, too
  std::optional<bool> spherical;                  ///< empty: as the sensor is
  std::optional<ReturnMode> return_mode;          ///< empty: as the sensor is
  std::optional<bool> imu;                        ///< inertial samples; empty: as the sensor is
};

/// Where a session stands.
enum class ClientState : std::uint8_t {
  connecting,  ///< handshake, device info, until the sensor is ready
  setting_up,  ///< coordinates, return mode, inertial samples, start
  sampling,
  stopping,  ///< stop, disconnect
  closed,    ///< as was asked
  lost,      ///< the sensor does not answer, or refuses
};

/// Something that happened in a session.
struct ClientEvent {
  /// What happened.
  enum class Kind : std::uint8_t {
    connected,     ///< the handshake was answered
    firmware,      ///< text is its number
    sensor_state,  ///< value is a SensorState
    status,        ///< value is a status, as recordings::Packet::status
    refused,       ///< text names the command; the session goes on
    sampling,      ///< data come from now on
    closed,        ///< as was asked
    lost,          ///< text says why
  };
  Kind kind = Kind::connected;
  std::uint32_t value = 0;
  std::string text;
};

/// A session from the handshake to its end. All times are ns of any clock that never goes back.
class ClientSession {
 public:
  /// Time between two heartbeats, ns.
  static constexpr std::int64_t kHeartbeatPeriod = 800'000'000;
  /// Time after which a command is sent again, ns.
  static constexpr std::int64_t kCommandTimeout = 500'000'000;
  /// Time without any reply after which a sensor is lost, ns.
  static constexpr std::int64_t kSilence = 2'500'000'000;

  ClientSession(const ClientSettings& settings, std::int64_t now_ns);

  /// Lets time pass: commands and heartbeats that are due go out, and a silent sensor is lost. By
  /// how much the call comes after next_ns() is no silence of the sensor.
  void advance(std::int64_t now_ns);
  /// A datagram that the sensor sent to the command port. What is no reply to a command of this
  /// session is counted and does nothing else.
  void receive(std::span<const std::uint8_t> datagram, std::int64_t now_ns);
  /// Ends the session: stops the data and disconnects. Goes on until closed or lost.
  void stop(std::int64_t now_ns);

  ClientState state() const { return state_; }  ///< where it stands
  /// When advance() has something to do next.
  std::int64_t next_ns() const;
  /// Datagrams for the sensor since the last call.
  std::vector<std::vector<std::uint8_t>> take_datagrams();
  /// Events since the last call.
  std::vector<ClientEvent> take_events();
  /// Time of the last reply, ns, and later by what calls of advance() came too late; that of the
  /// beginning before there is one.
  std::int64_t heard_ns() const { return heard_ns_; }
  /// Datagrams that were no frames, or none that a sensor sends now.
  std::uint64_t rejected() const { return rejected_; }

 private:
  void ask(const Command& command, std::int64_t now_ns);
  void send_pending(std::int64_t now_ns);
  void go_on(std::int64_t now_ns);
  void send_heartbeat(std::int64_t now_ns);
  void take_reply(const Frame& frame, std::int64_t now_ns);
  void note_heartbeat(const HeartbeatReply& reply);
  void lose(std::string why);
  void tell(ClientEvent::Kind kind, std::uint32_t value = 0, std::string text = {});

  ClientSettings settings_;
  ClientState state_ = ClientState::connecting;
  std::deque<Command> to_ask_;
  std::optional<Command> pending_;
  std::uint16_t sequence_ = 0, pending_sequence_ = 0, heartbeat_sequence_ = 0;
  std::int64_t pending_sent_ns_ = 0, heard_ns_ = 0, heartbeat_due_ns_ = 0;
  bool connected_ = false, identified_ = false, heartbeat_open_ = false;
  std::optional<std::uint8_t> sensor_state_;
  std::optional<std::uint32_t> status_;
  std::uint64_t rejected_ = 0;
  std::vector<std::vector<std::uint8_t>> datagrams_;
  std::vector<ClientEvent> events_;
};

}  // namespace risley::wire
