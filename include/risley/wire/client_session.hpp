// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The host's side of a session with one sensor, without sockets and clocks: time and datagrams in,
// datagrams and events out. Each generation of sensors has its own: HandshakeClient, ControlClient.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "risley/wire/commands.hpp"
#include "risley/wire/control_frame.hpp"

namespace risley::wire {

/// A host's settings for a sensor, and its listening ports.
struct ClientSettings {
  Address host;
  std::uint16_t data_port = 0, command_port = 0;  ///< inertial samples go to the data port, too
  std::optional<bool> spherical;                  ///< empty: as the sensor is
  std::optional<ReturnMode> return_mode;          ///< empty: as the sensor is
  std::optional<bool> imu;                        ///< inertial samples; empty: as configured in the
                                                  ///< sensor
};

/// Where a session stands.
enum class ClientState : std::uint8_t {
  connecting,  ///< until the sensor has answered and is ready
  setting_up,  ///< what to send and to whom, start
  sampling,
  stopping,
  closed,  ///< as was asked
  lost,    ///< the sensor does not answer, or refuses
};

/// Something that happened in a session.
struct ClientEvent {
  /// What happened.
  enum class Kind : std::uint8_t {
    connected,     ///< the sensor has answered
    firmware,      ///< text is its number
    sensor_state,  ///< value is a SensorState; first generation
    status,        ///< value is a status, as recordings::Packet::status; first generation
    report,        ///< report differs from the one before; second generation
    refused,       ///< text names the command; the session continues
    sampling,      ///< data come from now on
    closed,        ///< as was asked
    lost,          ///< text says why
  };
  Kind kind = Kind::connected;
  std::uint32_t value = 0;
  std::string text;
  SensorReport report = {};
};

/// A session from the first request to its end: requests are repeated until they are answered, and
/// a silent sensor is lost. All times are ns of any clock that never goes back.
class ClientSession {
 public:
  /// Time between two requested signs of life, ns.
  static constexpr std::int64_t kHeartbeatPeriod = 800'000'000;
  /// Time after which a request is sent again, ns.
  static constexpr std::int64_t kCommandTimeout = 500'000'000;
  /// Time without any reply after which a sensor is lost, ns.
  static constexpr std::int64_t kSilence = 2'500'000'000;

  virtual ~ClientSession() = default;
  ClientSession(const ClientSession&) = delete;
  ClientSession& operator=(const ClientSession&) = delete;

  /// Advances the time: due requests are sent, and a silent sensor is lost. A call later than
  /// next_ns() does not count as silence of the sensor.
  void advance(std::int64_t now_ns);
  /// A datagram that the sensor sent to the command port. A datagram that is not a reply to a
  /// request of this session is counted and has no other effect.
  void receive(std::span<const std::uint8_t> datagram, std::int64_t now_ns);
  /// Ends the session: stops the data and leaves the sensor. Continues until closed or lost.
  void stop(std::int64_t now_ns);

  ClientState state() const { return state_; }  ///< where it stands
  /// closed or lost
  bool over() const { return state_ == ClientState::closed || state_ == ClientState::lost; }
  /// Time at which advance() has something to do next.
  std::int64_t next_ns() const;
  /// Datagrams for the sensor since the last call.
  std::vector<std::vector<std::uint8_t>> take_datagrams();
  /// Events since the last call.
  std::vector<ClientEvent> take_events();
  /// Time of the last reply, ns, and later by what calls of advance() came too late; that of the
  /// beginning before there is one.
  std::int64_t heard_ns() const { return heard_ns_; }
  /// Datagrams that were not frames, or that no sensor sends now.
  std::uint64_t rejected() const { return rejected_; }

 protected:
  ClientSession(const ClientSettings& settings, std::int64_t now_ns)
      : settings_(settings), heard_ns_(now_ns) {}

  /// Sends the next of the requests that must be answered one after the other, if there is one.
  virtual void ask_next(std::int64_t now_ns) = 0;
  /// Replaces the remaining requests by those that end a session.
  virtual void ask_for_the_end() = 0;
  /// Bytes of a request for a sign of life.
  virtual std::vector<std::uint8_t> heartbeat(std::uint16_t sequence) = 0;
  /// receive(), for a session that is not over.
  virtual void take(std::span<const std::uint8_t> datagram, std::int64_t now_ns) = 0;

  /// Of the next request.
  std::uint16_t next_sequence() { return ++sequence_; }
  /// Sends a request until its reply comes.
  void send(std::vector<std::uint8_t> request, std::uint16_t sequence, std::int64_t now_ns);
  void send_heartbeat(std::int64_t now_ns);  ///< asks for a sign of life
  /// Takes a reply of this sequence. @return whether it answers the waiting request
  bool answers(std::uint16_t sequence, std::int64_t now_ns);
  bool answers_heartbeat(std::uint16_t sequence, std::int64_t now_ns);  ///< the same of that
  void go_on(std::int64_t now_ns);  ///< requests the next step, once the last request was answered
  void lose(std::string why);       ///< and reports it
  /// An event.
  void notify(ClientEvent::Kind kind, std::uint32_t value = 0, std::string text = {});
  void notify(const SensorReport& report);  ///< that it differs
  void reject() { ++rejected_; }            ///< a datagram
  /// The sensor has answered.
  void connect(std::int64_t now_ns);
  bool connected() const { return connected_; }  ///< connect() was called
  /// From now on.
  void set_heartbeat_period(std::int64_t period_ns) { heartbeat_period_ns_ = period_ns; }
  void set_state(ClientState state) { state_ = state; }         ///< that it is in now
  void close();                                                 ///< and reports it
  const ClientSettings& settings() const { return settings_; }  ///< as they were given

 private:
  /// A request that waits for its reply.
  struct Pending {
    std::uint16_t sequence = 0;
    std::vector<std::uint8_t> bytes;
    std::int64_t sent_ns = 0;
  };

  ClientSettings settings_;
  ClientState state_ = ClientState::connecting;
  std::optional<Pending> pending_;
  std::uint16_t sequence_ = 0, heartbeat_sequence_ = 0;
  std::int64_t heard_ns_ = 0, heartbeat_due_ns_ = 0, heartbeat_period_ns_ = kHeartbeatPeriod;
  bool connected_ = false, heartbeat_open_ = false;
  std::uint64_t rejected_ = 0;
  std::vector<std::vector<std::uint8_t>> datagrams_;
  std::vector<ClientEvent> events_;
};

}  // namespace risley::wire
