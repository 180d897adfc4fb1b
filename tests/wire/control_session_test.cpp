// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Both sides of a session of the second generation without a network.
#include <algorithm>
#include <functional>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/wire/control_client.hpp"
#include "risley/wire/control_sensor.hpp"

#include "wire/hex.hpp"

namespace risley::wire::control_session_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::uint8_t kMid360 = 9, kHap = 10;
const Address kHost{{192, 168, 1, 5}}, kSensor{{192, 168, 1, 112}}, kStranger{{192, 168, 1, 66}};
constexpr std::uint16_t kDataPort = 56301, kCommandPort = 56101;

ClientSettings settings() { return {kHost, kDataPort, kCommandPort, true, {}, true}; }
SensorIdentity identity(std::uint8_t type = kMid360) {
  return {"47MDGEN2000001", type, {13, 18, 2, 44}, kSensor};
}

/// A host and a sensor, and time in steps of 10 ms.
class Link {
 public:
  explicit Link(std::uint8_t type = kMid360, const ClientSettings& wanted = settings())
      : sensor(identity(type), 0), client(wanted, type, 0), ports(control_ports(type)) {}

  bool run(
      std::int64_t ms, const std::function<bool()>& holds = [] { return false; }) {
    for (const std::int64_t end = now + ms * kMs; now < end; now += 10 * kMs) {
      client.advance(now);
      sensor.advance(now);
      for (const auto& bytes : client.take_datagrams()) {
        if (to_sensor) sensor.receive({kHost, kCommandPort}, ports.command, bytes, now);
      }
      for (const auto& datagram : sensor.take_datagrams(now)) {
        const bool for_client = datagram.to == Endpoint{kHost, kCommandPort};
        if (to_client && for_client) client.receive(datagram.bytes, now);
        pushes += datagram.from == ports.push && datagram.from != ports.command ? 1 : 0;
      }
      for (auto& event : client.take_events()) events.push_back(event);
      if (holds()) return true;
    }
    return false;
  }
  bool run_until(ClientState state, std::int64_t ms) {
    return run(ms, [&] { return client.state() == state; });
  }
  std::size_t met(ClientEvent::Kind kind, const std::string& text = {}) const {
    return static_cast<std::size_t>(std::ranges::count_if(events, [&](const ClientEvent& event) {
      return event.kind == kind && (text.empty() || event.text == text);
    }));
  }

  std::int64_t now = 0;
  ControlSensor sensor;
  ControlClient client;
  ControlPorts ports;
  bool to_sensor = true, to_client = true;
  int pushes = 0;
  std::vector<ClientEvent> events;
};

/// The only reply to a request that comes from a host.
std::vector<std::uint8_t> answer(ControlSensor& sensor, const std::vector<std::uint8_t>& request,
                                 const Address& from = kHost) {
  sensor.receive({from, kCommandPort}, control_ports(kMid360).command, request, 0);
  EXPECT_TRUE(sensor.take_datagrams(ControlSensor::kReplyDelay - 1).empty()) << "not at once";
  const auto replies = sensor.take_datagrams(ControlSensor::kReplyDelay);
  EXPECT_EQ(replies.size(), 1U);
  if (replies.size() != 1) return {};
  EXPECT_EQ(replies[0].from, control_ports(kMid360).command);
  EXPECT_EQ(replies[0].to, (Endpoint{from, kCommandPort}));
  return replies[0].bytes;
}

TEST(ControlSession, FromTheFirstRequestToTheEnd) {
  for (const std::uint8_t type : {kMid360, kHap}) {
    Link link(type);
    ASSERT_TRUE(link.run_until(ClientState::sampling, 5000)) << int{type};
    EXPECT_TRUE(link.sensor.sampling() && link.sensor.imu());
    EXPECT_EQ(link.sensor.data_target(), (Endpoint{kHost, kDataPort}));
    EXPECT_EQ(link.sensor.imu_target(), (Endpoint{kHost, kDataPort}));
    EXPECT_EQ(link.sensor.data_type(), 1);
    EXPECT_EQ(link.met(ClientEvent::Kind::connected), 1U);
    EXPECT_EQ(link.met(ClientEvent::Kind::firmware, "13.18.2.44"), 1U);
    EXPECT_EQ(link.met(ClientEvent::Kind::refused), 0U);
    link.run(60'000);
    EXPECT_EQ(link.client.state(), ClientState::sampling);
    if (type == kMid360) {
      EXPECT_NEAR(link.pushes, 60, 3);
    }
    link.client.stop(link.now);
    ASSERT_TRUE(link.run_until(ClientState::closed, 1000));
    link.run(1000);
    EXPECT_EQ(link.sensor.work_state(), kIdleState);
    EXPECT_FALSE(link.sensor.sampling());
    EXPECT_EQ(link.client.rejected() + link.sensor.rejected(), 0U);
    EXPECT_EQ(link.sensor.handshakes(), 1U);
  }
}

TEST(ControlSession, TheSensorSaysHowItIs) {
  Link link;
  link.sensor.set_clock(1, 0);
  ASSERT_TRUE(link.run_until(ClientState::sampling, 5000));
  std::vector<std::uint8_t> states;
  for (const ClientEvent& event : link.events) {
    if (event.kind != ClientEvent::Kind::report) continue;
    if (states.empty() || states.back() != event.report.work_state) {
      states.push_back(*event.report.work_state);
    }
    EXPECT_EQ(event.report.temperature_cdeg, 5213);
    EXPECT_EQ(event.report.sync, 1);
    EXPECT_TRUE(trouble_words(event.report).empty());
  }
  EXPECT_EQ(states.front(), kIdleState);
  EXPECT_TRUE(std::ranges::find(states, kStartingState) != states.end());
  EXPECT_EQ(states.back(), kSamplingState);
  SensorReport report;
  const std::uint8_t diagnosis[] = {0x10, 0x02}, faults[] = {3, 0, 4, 1, 0, 0, 0, 0};
  const KeyValue list[] = {{kDiagnosisKey, diagnosis}, {kFaultsKey, faults}, {kStateKey, {}}};
  update_report(report, list);
  EXPECT_EQ(trouble_words(report),
            (std::vector<std::string>{"scanner: warning", "ranging: error", "fault 0104: error"}));
}

TEST(ControlSession, WhatWasSetOtherwiseIsSetBack) {
  Link link(kMid360, {kHost, kDataPort, kCommandPort, true, ReturnMode::dual, false});
  const std::uint8_t spherical[] = {3};
  const KeyValue list[] = {{kDataTypeKey, spherical}};
  const auto data = encode_list(list);
  answer(link.sensor, encode_control_frame({ControlCommand::set, false, false, 1, data}));
  ASSERT_EQ(link.sensor.data_type(), 3);
  ASSERT_TRUE(link.run_until(ClientState::sampling, 5000));
  EXPECT_EQ(link.sensor.data_type(), 1);
  EXPECT_FALSE(link.sensor.imu());
  EXPECT_EQ(link.met(ClientEvent::Kind::refused, "return mode"), 1U);
  link.client.stop(link.now);
  ASSERT_TRUE(link.run_until(ClientState::closed, 1000));
  EXPECT_EQ(link.sensor.data_type(), 3);
  EXPECT_TRUE(link.sensor.imu());
}

// Whatever single datagram is lost, the session comes about.
TEST(ControlSession, RequestsAndRepliesAreLost) {
  for (int lost = 0; lost < 30; ++lost) {
    Link link;
    int count = 0;
    link.run(8000, [&] {
      ++count;
      link.to_sensor = count / 2 != lost;
      link.to_client = (count + 1) / 2 != lost;
      return link.client.state() == ClientState::sampling;
    });
    EXPECT_EQ(link.client.state(), ClientState::sampling) << lost;
  }
}

TEST(ControlSession, ASensorThatStartsAgainIsSetUpAnew) {
  Link link;
  ASSERT_TRUE(link.run_until(ClientState::sampling, 5000));
  const std::uint8_t idle[] = {kIdleState};
  const KeyValue list[] = {{kTargetStateKey, idle}};
  const auto data = encode_list(list);
  link.sensor.receive({kStranger, 1}, link.ports.command,
                      encode_control_frame({ControlCommand::set, false, false, 1, data}), link.now);
  ASSERT_TRUE(link.run(3000, [&] { return !link.sensor.sampling(); }));
  ASSERT_TRUE(link.run(6000, [&] { return link.sensor.sampling(); }));
  EXPECT_EQ(link.met(ClientEvent::Kind::sampling), 1U);
  ASSERT_TRUE(link.run_until(ClientState::sampling, 1000));
  // One that dies is lost.
  link.to_client = false;
  const std::int64_t dead = link.now;
  ASSERT_TRUE(link.run_until(ClientState::lost, 4000));
  EXPECT_LE(link.now - dead, 3000 * kMs);
}

TEST(ControlSensor, AnswersAsTheProtocolHasIt) {
  ControlSensor sensor(identity(), 0);
  // A search is answered to who asks and to everybody.
  sensor.receive({kHost, kSearchPort}, kSearchPort,
                 bytes_of("AA001800 02000000 0000 0000 000000000000 0A92 00000000"), 0);
  const auto found = sensor.take_datagrams(ControlSensor::kReplyDelay);
  ASSERT_EQ(found.size(), 2U);
  for (const auto& one : found) {
    EXPECT_EQ(one.from, kSearchPort);
    EXPECT_EQ(one.bytes, bytes_of("AA003000 02000000 0000 0101 000000000000 293A 269018D3 "
                                  "000934374D4447454E323030303030310000C0A8017024DB"));
  }
  EXPECT_EQ(found[0].to, (Endpoint{kHost, kSearchPort}));
  EXPECT_FALSE(found[1].to.has_value());
  const auto ask = [&](const char* request, const char* reply) {
    EXPECT_EQ(answer(sensor, bytes_of(request)), bytes_of(reply)) << request;
  };
  ask("AA001E00 04000000 0101 0000 000000000000 B0DD 77E3E4DD 010000001080",
      "AA002000 04000000 0101 0101 000000000000 2296 C5AF2938 0001001080010001");
  // Where to send, as the maker's SDK says it, and the start.
  ask("AA004000 06000000 0001 0000 000000000000 2B3A CAB502B5 030000000500 0800C0A8010589DB88DB "
      "06000800C0A80105EDDBECDB 07000800C0A8010551DC50DC",
      "AA001B00 06000000 0001 0101 000000000000 7393 12D941FF 000000");
  EXPECT_EQ(sensor.data_target(), (Endpoint{kHost, 56301}));
  EXPECT_EQ(sensor.imu_target(), (Endpoint{kHost, 56401}));
  answer(sensor, bytes_of("AA002100 08000000 0001 0000 000000000000 3FB8 6FD5E7AD "
                          "010000001A00010001"));
  EXPECT_EQ(sensor.work_state(), kStartingState);
  for (std::int64_t ms = 0; ms < 1500; ms += 10) sensor.advance(ms * kMs);
  EXPECT_TRUE(sensor.sampling());
}

TEST(ControlSensor, RefusesWithTheRightCode) {
  ControlSensor sensor(identity(), 0);
  const auto code_of = [&](ControlCommand command, const std::vector<std::uint8_t>& data,
                           const Address& from = kHost) {
    const auto reply = answer(sensor, encode_control_frame({command, false, false, 1, data}), from);
    return std::vector<std::uint8_t>(reply.begin() + kControlHeaderBytes, reply.end());
  };
  const auto set = [&](std::uint16_t key, const std::vector<std::uint8_t>& value,
                       const Address& from = kHost) {
    const KeyValue list[] = {{key, value}};
    return code_of(ControlCommand::set, encode_list(list), from);
  };
  using Bytes = std::vector<std::uint8_t>;
  EXPECT_EQ(set(kDataTypeKey, {2}), (Bytes{0, 0, 0}));
  EXPECT_EQ(sensor.data_type(), 2);
  EXPECT_EQ(set(kDataTypeKey, {0x11}), (Bytes{3, 0, 0}));
  EXPECT_EQ(set(kDataTypeKey, {1, 1}), (Bytes{0x23, 0, 0}));
  EXPECT_EQ(set(kStateKey, {1}), (Bytes{0x22, 0x06, 0x80}));
  EXPECT_EQ(set(0x0021, {1}), (Bytes{0x20, 0x21, 0}));
  EXPECT_EQ(set(kTargetStateKey, {3}), (Bytes{3, 0x1A, 0}));
  // Nobody is sent what somebody else asked for, but groups are.
  const auto target = encode_target({kHost, 1, 2});
  const auto group = encode_target({{{239, 1, 1, 1}}, 1, 2});
  EXPECT_EQ(set(kPointTargetKey, {target.begin(), target.end()}, kStranger), (Bytes{3, 6, 0}));
  EXPECT_FALSE(sensor.connected());
  EXPECT_EQ(set(kPointTargetKey, {group.begin(), group.end()}, kStranger), (Bytes{0, 0, 0}));
  EXPECT_TRUE(sensor.connected());
  EXPECT_EQ(code_of(ControlCommand::set, {2, 0, 0, 0, 0, 0, 1, 0, 1}), (Bytes{0x24, 0, 0}));
  const std::uint16_t unknown[] = {kStateKey, 0x1234};
  EXPECT_EQ(code_of(ControlCommand::get, encode_keys(unknown)), (Bytes{0x20, 0, 0}));
  EXPECT_EQ(code_of(ControlCommand{0x0400}, {1}), (Bytes{0x20}));
  EXPECT_EQ(code_of(ControlCommand::log_switch, {0, 1}), (Bytes{0}));
  EXPECT_EQ(code_of(ControlCommand::factory_reset, Bytes(16)), (Bytes{1}));
  EXPECT_EQ(code_of(ControlCommand::reboot, {100, 0}), (Bytes{0}));
  EXPECT_EQ(sensor.take_reboot(), 100 * kMs);
  // All keys that the maker's SDK asks for.
  const std::uint16_t all[] = {0x0000, 0x0001, 0x0004, 0x0005, 0x0006, 0x0007, 0x0012, 0x0015,
                               0x0016, 0x0017, 0x0018, 0x0019, 0x001A, 0x001C, 0x8000, 0x8001,
                               0x8002, 0x8003, 0x8004, 0x8005, 0x8006, 0x8007, 0x8008, 0x8009,
                               0x800A, 0x800B, 0x800C, 0x800E, 0x8010, 0x8011};
  const auto everything = code_of(ControlCommand::get, encode_keys(all));
  EXPECT_EQ(everything[0], 0);
  EXPECT_EQ(io::load<std::uint16_t>(&everything[1]), std::size(all));
  EXPECT_THROW(ControlSensor({"", kMid360, {}, kSensor}, 0), InvalidArgument);
}

}  // namespace
}  // namespace risley::wire::control_session_test
