// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "risley/wire/commands.hpp"
#include "risley/wire/sensor_session.hpp"

namespace risley::wire {

/// Features of only some types of sensors.
struct SensorAbilities {
  bool return_modes = false;      ///< the host may choose returns: first, strongest, dual
  bool triple = false;            ///< three returns among them
  bool imu = false;               ///< inertial samples
  bool high_sensitivity = false;  ///< as a parameter
  bool scan_pattern = false;      ///< as a parameter
  std::uint16_t reserved = 0;     ///< Broadcast::reserved
};

/// A sensor of the first generation: it broadcasts until a host shakes hands, then obeys only that
/// host until it disconnects or its heartbeats stop.
class HandshakeSensor final : public SensorSession {
 public:
  /// Time between two broadcasts, ns.
  static constexpr std::int64_t kBroadcastPeriod = 1'000'000'000;
  /// Time without a heartbeat after which the host is dropped, ns.
  static constexpr std::int64_t kHeartbeatTimeout = 5'000'000'000;
  /// Shortest time between two messages of an abnormal status, ns.
  static constexpr std::int64_t kStatusPeriod = 100'000'000;

  /// @throws InvalidArgument for a broadcast code that is empty or too long
  HandshakeSensor(SensorIdentity identity, const SensorAbilities& abilities, std::int64_t now_ns);

  std::vector<std::uint16_t> ports() const override { return {kSensorPort}; }
  std::uint16_t broadcast_port() const override { return kBroadcastPort; }
  std::uint16_t data_port() const override { return kSensorPort; }
  std::uint16_t imu_port() const override { return kSensorPort; }
  /// Broadcasts, missing heartbeats, messages of an abnormal status.
  void advance(std::int64_t now_ns) override;
  /// Only commands with right checksums and lengths act, only those of the host, and without a host
  /// only a handshake: its payload must name the sender's address, so that no third party is
  /// flooded with data.
  void receive(const Endpoint& from, std::uint16_t port, std::span<const std::uint8_t> datagram,
               std::int64_t now_ns) override;
  std::uint8_t data_type() const override;
  std::int64_t next_ns() const override;

  /// The sensor's own status from now on, see recordings::Packet::status.
  void set_status(std::uint32_t status) { status_ = status; }
  bool spherical() const { return spherical_; }            ///< as commands have set it
  ReturnMode return_mode() const { return return_mode_; }  ///< as commands have set it

 private:
  void leave(std::int64_t now_ns);
  void shake_hands(const Endpoint& from, const Handshake& hand, std::uint16_t sequence,
                   std::int64_t now_ns);
  void say(const std::optional<Endpoint>& to, std::vector<std::uint8_t> bytes);
  std::optional<Reply> obey(const Command& command, std::int64_t now_ns);
  ParametersReply write(const WriteParameters& wanted);
  ParameterValues read(const ReadParameters& wanted) const;
  ParametersReply reset(const ResetParameters& wanted);
  std::uint8_t set_return_mode(std::uint8_t mode);

  SensorAbilities abilities_;
  std::uint16_t command_port_ = 0;  // of the host
  bool spherical_ = false, rain_filter_ = false, fan_ = true;
  ReturnMode return_mode_ = ReturnMode::first;
  std::uint8_t state_ = static_cast<std::uint8_t>(SensorState::normal);
  Extrinsics extrinsics_;
  std::map<std::uint16_t, std::uint8_t> parameters_;
  std::uint32_t status_ = 0;
  std::uint16_t sequence_ = 0;
  std::int64_t broadcast_due_ns_ = 0, heartbeat_ns_ = 0, status_due_ns_ = 0;
};

}  // namespace risley::wire
