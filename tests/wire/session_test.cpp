// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Both sides of a session without a network: what one says is handed to the other, or not.
#include <algorithm>
#include <functional>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/wire/handshake_client.hpp"
#include "risley/wire/handshake_sensor.hpp"

namespace risley::wire {
namespace {

constexpr std::int64_t kMs = 1'000'000;
const Address kHost{{192, 168, 1, 5}}, kSensor{{192, 168, 1, 41}}, kStranger{{192, 168, 1, 66}};
constexpr std::uint16_t kDataPort = 56001, kCommandPort = 55501;

ClientSettings settings() { return {kHost, kDataPort, kCommandPort, true, {}, {}}; }
SensorIdentity identity(std::uint8_t type = 1) {
  return {"0TFDG3B006H2Z11", type, {3, 8, 0, 0}, kSensor};
}
SensorAbilities abilities(std::uint8_t type = 1) {
  constexpr std::uint8_t kMid40 = 1, kAvia = 7;
  SensorAbilities result;
  result.return_modes = type != kMid40;
  if (type == kAvia) result = {true, true, true, true, true, kSensorPort};
  return result;
}

/// A host and a sensor, and time in steps of 10 ms.
class Link {
 public:
  explicit Link(const ClientSettings& wanted = settings(), std::uint8_t type = 1)
      : sensor(identity(type), abilities(type), 0), client(wanted, 0) {}

  /// Lets time pass until something holds. @return whether it came to hold
  bool run(
      std::int64_t ms, const std::function<bool()>& holds = [] { return false; }) {
    for (const std::int64_t end = now + ms * kMs; now < end; now += 10 * kMs) {
      client.advance(now);
      sensor.advance(now);
      for (const auto& bytes : client.take_datagrams()) {
        if (to_sensor) sensor.receive({kHost, kCommandPort}, kSensorPort, bytes, now);
      }
      for (const auto& datagram : sensor.take_datagrams(0)) {
        if (!datagram.to) {
          ++broadcasts;
        } else if (to_client) {
          EXPECT_EQ(*datagram.to, (Endpoint{kHost, kCommandPort}));
          client.receive(datagram.bytes, now);
        }
      }
      for (auto& event : client.take_events()) events.push_back(event);
      if (holds()) return true;
    }
    return false;
  }
  bool run_until(ClientState state, std::int64_t ms) {
    return run(ms, [&] { return client.state() == state; });
  }
  bool met(ClientEvent::Kind kind, const std::string& text = {}) const {
    return std::ranges::any_of(events, [&](const ClientEvent& event) {
      return event.kind == kind && (text.empty() || event.text == text);
    });
  }

  std::int64_t now = 0;
  HandshakeSensor sensor;
  HandshakeClient client;
  bool to_sensor = true, to_client = true;
  int broadcasts = 0;
  std::vector<ClientEvent> events;
};

TEST(Session, FromHandshakeToDisconnect) {
  Link link;
  ASSERT_TRUE(link.run_until(ClientState::sampling, 3000));
  EXPECT_TRUE(link.sensor.sampling());
  EXPECT_TRUE(link.sensor.spherical());
  EXPECT_EQ(link.sensor.data_target(), (Endpoint{kHost, kDataPort}));
  EXPECT_TRUE(link.met(ClientEvent::Kind::connected));
  EXPECT_TRUE(link.met(ClientEvent::Kind::firmware, "03.08.0000"));
  const int before = link.broadcasts;
  link.run(60'000);
  EXPECT_EQ(link.client.state(), ClientState::sampling);
  EXPECT_EQ(link.broadcasts, before) << "a sensor with a host keeps quiet";
  link.client.stop(link.now);
  ASSERT_TRUE(link.run_until(ClientState::closed, 1000));
  EXPECT_FALSE(link.sensor.connected());
  EXPECT_TRUE(link.met(ClientEvent::Kind::closed));
  EXPECT_EQ(link.client.rejected(), 0U);
  EXPECT_EQ(link.sensor.rejected(), 0U);
  link.run(2000);
  EXPECT_GT(link.broadcasts, before);
}

TEST(Session, SettingsReachTheSensor) {
  ClientSettings wanted = settings();
  wanted.spherical = false;
  wanted.return_mode = ReturnMode::triple;
  wanted.imu = true;
  Link avia(wanted, 7);
  ASSERT_TRUE(avia.run_until(ClientState::sampling, 3000));
  EXPECT_FALSE(avia.sensor.spherical());
  EXPECT_EQ(avia.sensor.return_mode(), ReturnMode::triple);
  EXPECT_TRUE(avia.sensor.imu());
  // Three returns are the Avia's; the session goes on and says so.
  Link mid70(wanted, 6);
  ASSERT_TRUE(mid70.run_until(ClientState::sampling, 3000));
  EXPECT_EQ(mid70.sensor.return_mode(), ReturnMode::first);
  EXPECT_TRUE(mid70.met(ClientEvent::Kind::refused, "return mode"));
  EXPECT_TRUE(mid70.met(ClientEvent::Kind::refused, "inertial rate"));
}

// Whatever single datagram is lost, the session comes about.
TEST(Session, CommandsAndRepliesAreLost) {
  for (int lost = 0; lost < 30; ++lost) {
    Link link;
    int count = 0;
    link.run(6000, [&] {
      ++count;
      link.to_sensor = count / 2 != lost;
      link.to_client = (count + 1) / 2 != lost;
      return link.client.state() == ClientState::sampling;
    });
    EXPECT_EQ(link.client.state(), ClientState::sampling) << lost;
  }
}

TEST(Session, ADeadSensorIsLostWithinThreeSeconds) {
  Link link;
  ASSERT_TRUE(link.run_until(ClientState::sampling, 3000));
  link.run(1000);
  const std::int64_t dead = link.now;
  link.to_client = false;
  ASSERT_TRUE(link.run_until(ClientState::lost, 4000));
  EXPECT_LE(link.now - dead, 3000 * kMs);
  EXPECT_TRUE(link.met(ClientEvent::Kind::lost));
  Link nobody;
  nobody.to_sensor = false;
  ASSERT_TRUE(nobody.run_until(ClientState::lost, 4000));
}

// Nobody asked the sensor anything meanwhile: that it did not answer says nothing.
TEST(Session, AClientThatStandsStillLosesNobody) {
  Link link;
  ASSERT_TRUE(link.run_until(ClientState::sampling, 3000));
  for (std::int64_t phase_ms = 0; phase_ms < 800; phase_ms += 50) {
    link.run(1000 + phase_ms);
    link.now += 4000 * kMs;  // less than a sensor waits
    link.run(1000);
    ASSERT_EQ(link.client.state(), ClientState::sampling) << phase_ms;
  }
  // A sensor that died meanwhile is found out.
  link.to_client = false;
  link.now += 4000 * kMs;
  const std::int64_t awake = link.now;
  ASSERT_TRUE(link.run_until(ClientState::lost, 4000));
  EXPECT_LE(link.now - awake, 3000 * kMs);
}

TEST(Session, AHostThatIsGoneIsForgotten) {
  Link link;
  ASSERT_TRUE(link.run_until(ClientState::sampling, 3000));
  link.to_sensor = false;
  const std::int64_t gone = link.now;
  ASSERT_TRUE(link.run(8000, [&] { return !link.sensor.connected(); }));
  EXPECT_GE(link.now - gone, 4000 * kMs);
  EXPECT_LE(link.now - gone, 5010 * kMs);
  EXPECT_FALSE(link.sensor.sampling());
}

TEST(Session, NobodyElseCommandsTheSensor) {
  Link link;
  ASSERT_TRUE(link.run_until(ClientState::sampling, 3000));
  std::uint64_t refused = 0;
  const auto expect_silence = [&](const Command& command) {
    link.sensor.receive({kStranger, kCommandPort}, kSensorPort, encode(command, 0), link.now);
    EXPECT_TRUE(link.sensor.take_datagrams(0).empty());
    EXPECT_EQ(link.sensor.rejected(), ++refused);
  };
  expect_silence(SetSampling{0});
  expect_silence(Disconnect{});
  expect_silence(QueryDeviceInfo{});
  expect_silence(Handshake{kStranger, 1, 2, 3});
  expect_silence(Handshake{kHost, 1, 2, 3});
  expect_silence(Reboot{0});
  EXPECT_TRUE(link.sensor.sampling());
  EXPECT_FALSE(link.sensor.take_reboot());
  // Nobody is sent data because somebody else asked for it.
  HandshakeSensor free(identity(), abilities(), 0);
  free.receive({kStranger, 999}, kSensorPort, encode(Command(Handshake{kHost, 1, 2, 3}), 7), 0);
  EXPECT_FALSE(free.connected());
  const auto answer = free.take_datagrams(0);
  ASSERT_EQ(answer.size(), 1U);
  EXPECT_EQ(answer[0].to, (Endpoint{kStranger, 999}));
  EXPECT_EQ(answer[0].bytes, encode(Reply(ResultReply{Handshake::kId, 1}), 7));
}

TEST(Session, DamagedFramesDoNothing) {
  Link link;
  ASSERT_TRUE(link.run_until(ClientState::sampling, 3000));
  auto stop = encode(Command(SetSampling{0}), 9);
  stop.back() ^= 1U;
  link.sensor.receive({kHost, kCommandPort}, kSensorPort, stop, link.now);
  EXPECT_TRUE(link.sensor.sampling());
  EXPECT_EQ(link.sensor.rejected(), 1U);
  // Replies to no request, of another sequence, or to another command.
  const auto hand_over = [&](const Reply& reply) {
    link.client.receive(encode(reply, 60'000), link.now);
  };
  hand_over(ResultReply{SetSampling::kId, 0});
  hand_over(HeartbeatReply{0, 4, 0, 0});
  hand_over(ResultReply{Disconnect::kId, 0});
  EXPECT_EQ(link.client.rejected(), 3U);
  EXPECT_EQ(link.client.state(), ClientState::sampling);
}

TEST(Session, AClientThatStartsAgainGetsItsReply) {
  HandshakeSensor sensor(identity(), abilities(), 0);
  sensor.receive({kHost, 1}, kSensorPort, encode(Command(Handshake{kHost, 1, 2, {}}), 1), 0);
  sensor.receive({kHost, 1}, kSensorPort, encode(Command(SetSampling{1}), 2), 0);
  EXPECT_TRUE(sensor.sampling());
  EXPECT_EQ(sensor.imu_target(), (Endpoint{kHost, 1})) << "early clients name no such port";
  sensor.take_datagrams(0);
  sensor.receive({kHost, 5}, kSensorPort, encode(Command(Handshake{kHost, 11, 12, 13}), 1), 0);
  EXPECT_FALSE(sensor.sampling());
  const auto answer = sensor.take_datagrams(0);
  ASSERT_EQ(answer.size(), 1U);
  EXPECT_EQ(answer[0].to, (Endpoint{kHost, 12}));
  EXPECT_EQ(sensor.imu_target(), (Endpoint{kHost, 13}));
  EXPECT_EQ(sensor.handshakes(), 2U);
}

TEST(Session, CommandsWithTheTypeOfReplies) {
  HandshakeSensor sensor(identity(), abilities(), 0);
  const std::vector<std::uint8_t> data = {192, 168, 1, 5, 1, 0, 2, 0, 3, 0};
  sensor.receive({kHost, 2}, kSensorPort, encode_frame({FrameType::reply, 1, Handshake::kId, data}),
                 0);
  EXPECT_TRUE(sensor.connected());
}

TEST(Session, ASensorAnswersEveryCommand) {
  Link link({kHost, kDataPort, kCommandPort, {}, {}, {}}, 7);
  ASSERT_TRUE(link.run_until(ClientState::sampling, 3000));
  const auto expect_answer = [&](const Command& command, const Reply& expected) {
    SCOPED_TRACE(to_string(command_id(command)));
    link.sensor.receive({kHost, kCommandPort}, kSensorPort, encode(command, 321), link.now);
    const auto datagrams = link.sensor.take_datagrams(0);
    ASSERT_EQ(datagrams.size(), 1U);
    EXPECT_EQ(datagrams[0].bytes, encode(expected, 321));
  };
  expect_answer(SetFan{0}, ResultReply{SetFan::kId, 0});
  expect_answer(QueryFan{}, ValueReply{QueryFan::kId, 0, 0});
  expect_answer(SetRainFilter{1}, ResultReply{SetRainFilter::kId, 0});
  expect_answer(Heartbeat{}, HeartbeatReply{0, 1, 1, 0});
  expect_answer(SetReturnMode{2}, ResultReply{SetReturnMode::kId, 0});
  expect_answer(QueryReturnMode{}, ValueReply{QueryReturnMode::kId, 0, 2});
  expect_answer(SetImuRate{1}, ResultReply{SetImuRate::kId, 0});
  expect_answer(QueryImuRate{}, ValueReply{QueryImuRate::kId, 0, 1});
  const Extrinsics pose{{1, 2, 3}, {4, 5, 6}};
  expect_answer(WriteExtrinsics{pose}, ResultReply{WriteExtrinsics::kId, 0});
  expect_answer(ReadExtrinsics{}, ExtrinsicsReply{0, pose});
  expect_answer(QueryAddress{}, AddressReply{0, true, kSensor, {}, {}});
  expect_answer(WriteParameters{{{2, {1}}}}, ParametersReply{WriteParameters::kId, 0, 0, 0});
  expect_answer(ReadParameters{{2}}, ParameterValues{0, 0, 0, {{2, {1}}}});
  expect_answer(ReadParameters{{99}}, ParameterValues{1, 99, 1, {}});
  expect_answer(ResetParameters{false, {}}, ParametersReply{ResetParameters::kId, 0, 0, 0});
  expect_answer(ReadParameters{{2}}, ParameterValues{0, 0, 0, {{2, {0}}}});
  expect_answer(SetUtc{}, ResultReply{SetUtc::kId, 1});
  expect_answer(SetMode{3}, ResultReply{SetMode::kId, 0});
  EXPECT_FALSE(link.sensor.sampling());
  expect_answer(SetSampling{1}, ResultReply{SetSampling::kId, 1});
  expect_answer(Reboot{20}, ResultReply{Reboot::kId, 0});
  EXPECT_EQ(link.sensor.take_reboot(), 20 * kMs);
}

TEST(Session, AnAbnormalStatusIsToldTenTimesASecond) {
  Link link;
  ASSERT_TRUE(link.run_until(ClientState::sampling, 3000));
  constexpr std::uint32_t kHot = 0x80000002;
  link.sensor.set_status(kHot);
  int told = 0;
  for (int step = 0; step < 100; ++step) {
    link.now += 10 * kMs;
    link.sensor.advance(link.now);
    for (const auto& datagram : link.sensor.take_datagrams(0)) {
      ++told;
      link.client.receive(datagram.bytes, link.now);
    }
  }
  EXPECT_EQ(told, 10);
  const auto events = link.client.take_events();
  ASSERT_EQ(events.size(), 1U) << "once";
  EXPECT_EQ(events[0].kind, ClientEvent::Kind::status);
  EXPECT_EQ(events[0].value, kHot);
}

TEST(Session, CodesOfSensors) {
  EXPECT_THROW(HandshakeSensor({"", 1, {}, kSensor}, {}, 0), InvalidArgument);
  EXPECT_THROW(HandshakeSensor({"sixteen letters.", 1, {}, kSensor}, {}, 0), InvalidArgument);
}

}  // namespace
}  // namespace risley::wire
