// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The sensor's side of a session, without sockets and clocks: time and datagrams in, datagrams out.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "risley/wire/commands.hpp"

namespace risley::wire {

/// What only some types of sensors can do.
struct SensorAbilities {
  bool return_modes = false;      ///< the host may choose returns: first, strongest, dual
  bool triple = false;            ///< three returns among them
  bool imu = false;               ///< inertial samples
  bool high_sensitivity = false;  ///< as a parameter
  bool scan_pattern = false;      ///< as a parameter
  std::uint16_t reserved = 0;     ///< Broadcast::reserved
};

/// Who a virtual sensor is.
struct SensorIdentity {
  std::string code;              ///< broadcast code, at most 15 characters
  std::uint8_t device_type = 1;  ///< as recordings::Device::type
  std::array<std::uint8_t, 4> firmware{};
  Address address;  ///< what QueryAddress is answered with
  SensorAbilities abilities;
};

/// A sensor as hosts see it through commands: it broadcasts until a host shakes hands, then obeys
/// that host alone until it disconnects or its heartbeats stay away. All times are ns of any clock
/// that never goes back.
class SensorSession {
 public:
  /// Time between two broadcasts, ns.
  static constexpr std::int64_t kBroadcastPeriod = 1'000'000'000;
  /// Time without a heartbeat after which the host is forgotten, ns.
  static constexpr std::int64_t kHeartbeatTimeout = 5'000'000'000;
  /// Shortest time between two messages of an abnormal status, ns.
  static constexpr std::int64_t kStatusPeriod = 100'000'000;

  /// @throws InvalidArgument for a broadcast code that is empty or too long
  SensorSession(SensorIdentity identity, std::int64_t now_ns);

  /// A datagram for the network; without `to` it is broadcast to kBroadcastPort.
  struct Outgoing {
    std::optional<Endpoint> to;
    std::vector<std::uint8_t> bytes;
  };

  /// Lets time pass: broadcasts, heartbeats that stay away, messages of an abnormal status.
  void advance(std::int64_t now_ns);
  /// A datagram that arrived at kSensorPort. Only commands with right checksums and lengths act,
  /// only those of the host, and only a handshake where there is none: whose payload names the
  /// address that it comes from, so that nobody is sent what somebody else asked for.
  void receive(const Endpoint& from, std::span<const std::uint8_t> datagram, std::int64_t now_ns);
  /// As the sensor knows itself from now on, see recordings::Packet::status.
  void set_status(std::uint32_t status) { status_ = status; }

  bool connected() const { return host_.has_value(); }  ///< a host has shaken hands
  bool sampling() const { return sampling_; }           ///< data are to be sent
  /// Of data, as commands have set it.
  bool spherical() const { return spherical_; }
  ReturnMode return_mode() const { return return_mode_; }  ///< as commands have set it
  bool imu() const { return imu_; }                        ///< inertial samples are to be sent
  /// Where data go; of use while connected.
  Endpoint data_target() const { return {host_.value_or(Address{}), data_port_}; }
  /// Where inertial samples go; of use while connected.
  Endpoint imu_target() const { return {host_.value_or(Address{}), imu_port_}; }
  /// Takes a Reboot that was commanded: its delay, ns.
  std::optional<std::int64_t> take_reboot();

  std::int64_t next_ns() const;  ///< when advance() has something to do next
  /// Datagrams since the last call.
  std::vector<Outgoing> take_datagrams();
  /// Datagrams that were no frames, or not for this sensor in its state.
  std::uint64_t rejected() const { return rejected_; }
  /// Sessions that were begun.
  std::uint64_t handshakes() const { return handshakes_; }

 private:
  void leave(std::int64_t now_ns);
  void shake_hands(const Endpoint& from, const Handshake& hand, std::uint16_t sequence,
                   std::int64_t now_ns);
  std::optional<Reply> obey(const Command& command, std::int64_t now_ns);
  ParametersReply write(const WriteParameters& wanted);
  ParameterValues read(const ReadParameters& wanted) const;
  ParametersReply reset(const ResetParameters& wanted);
  std::uint8_t set_return_mode(std::uint8_t mode);

  SensorIdentity identity_;
  std::optional<Address> host_;
  std::uint16_t data_port_ = 0, imu_port_ = 0, command_port_ = 0;
  bool sampling_ = false, spherical_ = false, imu_ = false, rain_filter_ = false, fan_ = true;
  ReturnMode return_mode_ = ReturnMode::first;
  std::uint8_t state_ = static_cast<std::uint8_t>(SensorState::normal);
  Extrinsics extrinsics_;
  std::map<std::uint16_t, std::uint8_t> parameters_;
  std::uint32_t status_ = 0;
  std::optional<std::int64_t> reboot_;
  std::uint16_t sequence_ = 0;
  std::int64_t broadcast_due_ns_ = 0, heartbeat_ns_ = 0, status_due_ns_ = 0;
  std::uint64_t rejected_ = 0, handshakes_ = 0;
  std::vector<Outgoing> datagrams_;
};

}  // namespace risley::wire
