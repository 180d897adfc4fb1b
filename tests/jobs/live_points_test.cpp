// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/live_points.hpp"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "risley/bags/messages.hpp"
#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/recordings/livox/packet_decoder.hpp"

#include "jobs/emulated_scan.hpp"

namespace risley::jobs::live_points_test {
namespace {

constexpr std::uint8_t kSpherical = 1;  // of the Mid-40
constexpr std::int64_t kMillisecond = 1'000'000, kSecond = 1'000'000'000;

/// A bag in memory, whose messages are looked at when they come.
class MemoryBag final : public bags::BagWriter {
 public:
  std::size_t add(const bags::Topic& topic) override {
    const auto known = std::ranges::find(topics, topic.name, &bags::Topic::name);
    if (known == topics.end()) topics.push_back(topic);
    return 0;
  }
  void write(std::size_t, const bags::Message& message) override {
    bags::PointCloud2 cloud;
    bags::decode(bags::Serialisation::cdr, message.bytes, cloud);
    const auto time = std::ranges::find(cloud.fields, "timestamp", &bags::PointFieldEntry::name);
    const std::scoped_lock lock(mutex);
    frames.push_back(cloud.width);
    for (std::uint32_t i = 0; i < cloud.width; ++i) {
      times.push_back(static_cast<std::int64_t>(
          io::load<double>(cloud.data.data() + i * cloud.point_step + time->offset)));
    }
  }
  void close() override {}

  std::mutex mutex;
  std::vector<bags::Topic> topics;
  std::vector<std::uint32_t> frames;
  std::vector<std::int64_t> times;  ///< of points
};

struct Packet {
  std::vector<std::uint8_t> bytes;
  std::int64_t time_ns = 0;
};

/// Packets of a virtual Mid-40. @param begin_ns  time of the first one
std::vector<Packet> packets_of(double seconds, std::int64_t begin_ns = 0) {
  SimulationOptions options;
  options.rotor = simulation::RotorKind::hunting;
  options.threads = 1;
  EmulatedScan scan(options, "");
  std::vector<Packet> packets;
  for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(1000 * seconds); ++i) {
    const std::int64_t time = begin_ns + scan.time_of(i, kSpherical);
    const auto bytes = scan.next(kSpherical, time);
    packets.push_back({{bytes.begin(), bytes.end()}, time});
  }
  return packets;
}

/// Times of the returns in packets.
std::set<std::int64_t> times_of_returns(const std::vector<Packet>& packets) {
  std::set<std::int64_t> times;
  for (const Packet& packet : packets) {
    recordings::livox::PacketDecoder decoder({});
    recordings::Chunk chunk;
    decoder.decode(packet.bytes, chunk);
    const auto& rows = chunk.observations;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (rows.valid[i] != 0 && rows.range[i] > 0) times.insert(rows.time_ns[i]);
    }
  }
  return times;
}

class LivePointsTest : public ::testing::Test {
 protected:
  static LivePointsOptions options(MemoryBag& bag, const std::string& calibration = {}) {
    LivePointsOptions result;
    result.calibration = calibration;
    result.bag = &bag;
    return result;
  }
  static WatchedSensor mid_40() { return {"LIVE00000000001", recordings::kMid40}; }

  PublishedPoints publish(const std::vector<Packet>& packets, const std::string& calibration = {}) {
    LivePoints points({mid_40()}, options(bag_, calibration));
    for (const Packet& packet : packets) points.add(0, packet.bytes, packet.time_ns);
    points.finish(60);
    return points.published().front();
  }

  MemoryBag bag_;
};

TEST_F(LivePointsTest, EveryReturnIsAPointInAFrame) {
  const auto packets = packets_of(3);
  const PublishedPoints published = publish(packets, "mid-40");
  const std::set<std::int64_t> returns = times_of_returns(packets);
  EXPECT_EQ(published.words, "");
  EXPECT_EQ(published.calibration, "mid-40");
  EXPECT_TRUE(published.is_calibrated);
  EXPECT_EQ(published.missing_packets, 0U);
  EXPECT_EQ(published.points, bag_.times.size());
  EXPECT_EQ(published.frames, bag_.frames.size());
  const std::set<std::int64_t> times(bag_.times.begin(), bag_.times.end());
  EXPECT_EQ(times.size(), bag_.times.size());
  EXPECT_TRUE(std::ranges::is_sorted(bag_.times));
  EXPECT_TRUE(std::ranges::includes(returns, times));
  EXPECT_GT(static_cast<double>(times.size()), 0.999 * static_cast<double>(returns.size()));
  // 50 ms each, the first of them together.
  EXPECT_GE(bag_.frames.size(), 60U);
  EXPECT_LE(bag_.frames.size(), 62U);
  ASSERT_EQ(bag_.topics.size(), 1U);
  EXPECT_EQ(bag_.topics.front().name, "/risley/points");
  EXPECT_EQ(bag_.topics.front().type, "sensor_msgs/msg/PointCloud2");
}

TEST_F(LivePointsTest, SomeDisorderIsPutRightAndTheRestCounted) {
  std::vector<Packet> packets = packets_of(2);
  std::swap(packets[1500].bytes, packets[1503].bytes);
  packets.insert(packets.begin() + 1700, packets[1699]);  // comes twice
  Packet late = packets[1800];
  packets.erase(packets.begin() + 1800);
  packets.insert(packets.begin() + 1950, late);
  const PublishedPoints published = publish(packets);
  EXPECT_EQ(published.missing_packets, 1U);
  EXPECT_TRUE(std::ranges::is_sorted(bag_.times));
  const std::set<std::int64_t> times(bag_.times.begin(), bag_.times.end());
  EXPECT_EQ(times.size(), bag_.times.size());
  EXPECT_TRUE(times.contains(late.time_ns - kMillisecond));
  EXPECT_FALSE(times.contains(late.time_ns));
}

/// The sensor restarts: its rotors are elsewhere, and its clock begins again.
TEST_F(LivePointsTest, AfterAJumpOfTheClockPointsComeAgain) {
  std::vector<Packet> packets = packets_of(2, 5 * kSecond);
  const std::size_t before = packets.size();
  for (Packet& packet : packets_of(2.5)) packets.push_back(std::move(packet));
  const PublishedPoints published = publish(packets);
  EXPECT_EQ(published.words, "");
  EXPECT_EQ(published.missing_packets, 0U);
  const auto returns =
      static_cast<double>(times_of_returns({packets.begin(), packets.begin() + before}).size() +
                          times_of_returns({packets.begin() + before, packets.end()}).size());
  EXPECT_GT(static_cast<double>(published.points), 0.999 * returns);
  EXPECT_EQ(published.points, bag_.times.size());
}

/// Rotors that cannot be found, such as those of a sensor that warms up, are looked for again.
TEST_F(LivePointsTest, ShotsThatMakeNoSenseAreToldOf) {
  std::vector<Packet> packets = packets_of(1.5);
  std::reverse(packets.begin(), packets.end());
  for (std::size_t i = 0; i < packets.size() / 2; ++i) {  // each has another's time
    std::swap_ranges(packets[i].bytes.begin() + 10, packets[i].bytes.begin() + 18,
                     packets[packets.size() - 1 - i].bytes.begin() + 10);
  }
  MemoryBag bag;
  LivePoints points({mid_40()}, options(bag));
  for (const Packet& packet : packets) points.add(0, packet.bytes, packet.time_ns);
  for (int i = 0; i < 600 && points.published().front().words.empty(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  EXPECT_NE(points.published().front().words, "");
  for (const Packet& packet : packets_of(2.5, 20 * kSecond)) {
    points.add(0, packet.bytes, packet.time_ns);
  }
  points.finish(60);
  EXPECT_EQ(points.published().front().words, "");
  EXPECT_GT(points.published().front().points, 100'000U);
}

TEST_F(LivePointsTest, WhatItIsTooSlowForIsDroppedAndCounted) {
  const auto packets = packets_of(1);
  MemoryBag bag;
  LivePoints points({mid_40()}, options(bag));
  for (std::size_t i = 0; i < 3 * LivePoints::kMostWaiting; ++i) {
    points.add(0, packets[i % packets.size()].bytes, 0);
  }
  EXPECT_GT(points.published().front().missing_packets, LivePoints::kMostWaiting);
}

TEST_F(LivePointsTest, SensorsHaveTopicsOfTheirOwn) {
  LivePoints points({mid_40(), {"192.168.1.5", recordings::kUnknownDeviceType}}, options(bag_));
  for (const Packet& packet : packets_of(1.5)) {
    points.add(0, packet.bytes, packet.time_ns);
    points.add(1, packet.bytes, packet.time_ns);
  }
  points.finish(60);
  ASSERT_EQ(bag_.topics.size(), 1U);
  EXPECT_EQ(bag_.topics.front().name, "/risley/points/LIVE00000000001");
  EXPECT_FALSE(points.published()[0].is_calibrated);
  EXPECT_NE(points.published()[1].words, "");
  EXPECT_EQ(points.published()[1].points, 0U);
}

TEST_F(LivePointsTest, WhatCannotBeIsRefused) {
  EXPECT_THROW(LivePoints({mid_40()}, options(bag_, "avia")), InvalidArgument);
  LivePointsOptions slow = options(bag_);
  slow.messages.frame_rate = 1;
  EXPECT_THROW(require_usable(slow), InvalidArgument);
  EXPECT_THROW(require_usable(options(bag_, "no-such-sensor")), Error);
}

}  // namespace
}  // namespace risley::jobs::live_points_test
