// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "risley/wire/control_frame.hpp"
#include "risley/wire/sensor_session.hpp"

namespace risley::wire {

/// A sensor of the second generation: it answers searches, and any host may set and query its keys.
/// It samples in the work state that it was set to, whether or not a host still listens.
class ControlSensor final : public SensorSession {
 public:
  /// Time between two pushes of its settings and state, ns.
  static constexpr std::int64_t kPushPeriod = 1'000'000'000;
  /// From a request to its reply, ns: the maker's SDK misses immediate replies.
  static constexpr std::int64_t kReplyDelay = 2'000'000;
  /// Until its motors run, ns.
  static constexpr std::int64_t kMotorStart = 1'000'000'000;

  /// @throws InvalidArgument for a serial number that is empty or too long
  ControlSensor(SensorIdentity identity, std::int64_t now_ns);

  std::vector<std::uint16_t> ports() const override;
  std::uint16_t public_port() const override { return kSearchPort; }
  std::uint16_t broadcast_port() const override { return kSearchPort; }
  std::uint16_t data_port() const override { return ports_.points; }
  std::uint16_t imu_port() const override { return ports_.imu; }
  /// Pushes, and the work state on its way to the requested one.
  void advance(std::int64_t now_ns) override;
  /// Requests with right checksums are answered, unknown ones too, to their sender. A target must
  /// be the sender's address or a multicast one, so that no third party is flooded with replies.
  void receive(const Endpoint& from, std::uint16_t port, std::span<const std::uint8_t> datagram,
               std::int64_t now_ns) override;
  std::uint8_t data_type() const override { return values_.at(kDataTypeKey)[0]; }
  void set_clock(std::uint8_t sync, std::int64_t ahead_ns) override;
  std::int64_t next_ns() const override;
  std::vector<Outgoing> take_datagrams(std::int64_t now_ns) override;

  std::uint8_t work_state() const { return state_; }  ///< see work_state_words()

 private:
  using Bytes = std::vector<std::uint8_t>;

  void reset_values();
  Bytes answer(const Endpoint& from, const ControlFrame& frame, std::int64_t now_ns);
  Bytes answer_search() const;
  Bytes answer_get(std::span<const std::uint8_t> data, std::int64_t now_ns);
  Bytes answer_set(const Address& from, const ControlFrame& frame, std::int64_t now_ns);
  /// @return code of a reply
  std::uint8_t judge(const Address& from, const KeyValue& entry) const;
  void follow_values(std::int64_t now_ns);
  void refresh(std::int64_t now_ns);
  void take_step(std::int64_t now_ns);

  ControlPorts ports_;
  std::map<std::uint16_t, Bytes> values_;
  std::uint8_t state_ = kIdleState;
  std::uint8_t sync_ = 0;
  std::int64_t ahead_ns_ = 0, step_due_ns_ = 0, push_due_ns_ = 0;
  std::uint32_t push_sequence_ = 0;
  std::deque<std::pair<std::int64_t, Outgoing>> replies_;  // by when they are due
};

}  // namespace risley::wire
