// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The sensor's side of a session, without sockets and clocks: time and datagrams in, datagrams out.
// Each generation of sensors has its own: HandshakeSensor, ControlSensor.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "risley/wire/address.hpp"

namespace risley::wire {

/// Identity of a virtual sensor.
struct SensorIdentity {
  std::string code;              ///< serial number (broadcast code), at most 15 characters
  std::uint8_t device_type = 1;  ///< as recordings::Device::type
  std::array<std::uint8_t, 4> firmware{};
  Address address;  ///< its reported address
};

/// A sensor as seen by hosts through commands. All times are ns of any clock that never goes back.
class SensorSession {
 public:
  virtual ~SensorSession() = default;
  SensorSession(const SensorSession&) = delete;
  SensorSession& operator=(const SensorSession&) = delete;

  /// A datagram for the network.
  struct Outgoing {
    std::uint16_t from = 0;      ///< port of the sensor
    std::optional<Endpoint> to;  ///< empty: everybody, at broadcast_port()
    std::vector<std::uint8_t> bytes;
  };

  /// Ports at which the sensor listens.
  virtual std::vector<std::uint16_t> ports() const = 0;
  /// The one of them for broadcasts; 0: none.
  virtual std::uint16_t public_port() const { return 0; }
  /// Port of hosts to which it broadcasts.
  virtual std::uint16_t broadcast_port() const = 0;
  /// Lets time pass.
  virtual void advance(std::int64_t now_ns) = 0;
  /// A datagram that arrived at a port. Datagrams not meant for this sensor in its state are
  /// counted and have no other effect.
  virtual void receive(const Endpoint& from, std::uint16_t port,
                       std::span<const std::uint8_t> datagram, std::int64_t now_ns) = 0;
  /// Data type of the packets to send.
  virtual std::uint8_t data_type() const = 0;
  virtual std::uint16_t data_port() const = 0;  ///< from which points are sent
  virtual std::uint16_t imu_port() const = 0;   ///< from which inertial samples are sent
  /// Time source of the sensor's clock from now on, as SensorReport::sync, and its lead over the
  /// session's clock, ns.
  virtual void set_clock(std::uint8_t /*sync*/, std::int64_t /*ahead_ns*/) {}
  /// Time at which advance() or take_datagrams() has something to do next.
  virtual std::int64_t next_ns() const = 0;
  /// Datagrams that are due since the last call.
  virtual std::vector<Outgoing> take_datagrams(std::int64_t now_ns);

  bool connected() const { return connected_; }  ///< a host has named the destination of the data
  bool sampling() const { return sampling_; }    ///< data are to be sent
  bool imu() const { return imu_; }              ///< inertial samples are to be sent
  /// Destination of the data; valid while connected.
  const Endpoint& data_target() const { return data_target_; }
  /// Where inertial samples go; of use while connected.
  const Endpoint& imu_target() const { return imu_target_; }
  /// Takes a reboot that was commanded: its delay, ns.
  std::optional<std::int64_t> take_reboot();
  std::uint64_t rejected() const { return rejected_; }      ///< datagrams
  std::uint64_t handshakes() const { return handshakes_; }  ///< times that a host connected

 protected:
  /// @throws InvalidArgument for a code that is empty or too long
  explicit SensorSession(SensorIdentity identity);
  const SensorIdentity& identity() const { return identity_; }  ///< as it was given

  bool connected_ = false, sampling_ = false, imu_ = false;
  Endpoint data_target_, imu_target_;
  std::optional<std::int64_t> reboot_;
  std::uint64_t rejected_ = 0, handshakes_ = 0;
  std::vector<Outgoing> datagrams_;

 private:
  SensorIdentity identity_;
};

}  // namespace risley::wire
