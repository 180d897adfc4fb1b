// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/packet_order.hpp"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "risley/io/little_endian.hpp"
#include "risley/recordings/livox/packet_encoder.hpp"

namespace risley::recordings::livox::order_test {

constexpr std::int64_t kMicrosecond = 1000, kMillisecond = 1'000'000, kSecond = 1'000'000'000;

/// A packet without a return of a sensor that counts from power-on or as the type says.
std::vector<std::uint8_t> packet(std::int64_t time_ns, std::uint8_t data_type = 1,
                                 std::uint8_t timestamp_type = 0) {
  Packet header;
  header.data_type = data_type;
  header.timestamp_type = timestamp_type;
  header.timestamp = encode_timestamp(timestamp_type, time_ns);
  std::vector<std::uint8_t> bytes(kPacketHeaderBytes + record_layout(data_type)->bytes());
  encode_packet_header(header, bytes.data());
  return bytes;
}

std::int64_t time_of(const std::vector<std::uint8_t>& bytes) {
  return io::load<std::int64_t>(&bytes[10]);
}

struct Kind {
  std::uint8_t device_type, data_type;
  std::int64_t period_ns;
};
// The table of the protocol.
constexpr Kind kKinds[] = {
    {1, 0, kMillisecond},       {1, 1, kMillisecond},       {6, 2, 960 * kMicrosecond},
    {6, 3, 960 * kMicrosecond}, {6, 4, 480 * kMicrosecond}, {6, 5, 480 * kMicrosecond},
    {7, 2, 400 * kMicrosecond}, {3, 3, 400 * kMicrosecond}, {2, 4, 200 * kMicrosecond},
    {7, 5, 200 * kMicrosecond}, {7, 7, 125 * kMicrosecond}, {7, 8, 125 * kMicrosecond},
    {7, 6, 5 * kMillisecond},
};

TEST(PacketOrder, CountsWhatIsMissingOfEveryType) {
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(int{kind.data_type});
    PacketOrder order(kind.device_type);
    std::uint64_t missing = 0, sent = 0;
    for (std::int64_t i = 0; i < 5000; ++i) {
      if (i % 7 == 3 || (i > 100 && i < 130)) {
        ++missing;
        continue;
      }
      ++sent;
      ASSERT_TRUE(
          order.add(packet(7 * kSecond + i * kind.period_ns, kind.data_type), i * kind.period_ns));
    }
    order.flush();
    EXPECT_EQ(order.counts().lost, missing);
    EXPECT_EQ(order.counts().packets, sent);
    EXPECT_EQ(order.counts().rows, sent * record_layout(kind.data_type)->rows());
    EXPECT_EQ(order.counts().imu_samples, kind.data_type == 6 ? sent : 0);
    EXPECT_EQ(order.counts().clock_jumps, 0U);
    EXPECT_EQ(order.take().size(), sent);
  }
}

// Loss, duplicates and packets that overtake up to ten others: every one counted, all in order.
TEST(PacketOrder, LossDuplicatesAndDisorder) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    std::vector<std::pair<int, int>> arrivals;  // place, number
    std::uint64_t missing = 0, doubled = 0;
    constexpr int kCount = 20'000;
    for (int i = 0; i < kCount; ++i) {
      const bool inside = i > 0 && i < kCount - 1;
      if (inside && random() % 100 == 0) {
        ++missing;
        continue;
      }
      const auto place = [&] { return i + (random() % 20 == 0 ? int(random() % 11) : 0); };
      arrivals.emplace_back(place(), i);
      if (random() % 100 == 0) {
        ++doubled;
        arrivals.emplace_back(place(), i);
      }
    }
    std::stable_sort(arrivals.begin(), arrivals.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    PacketOrder order(1);
    std::vector<std::int64_t> times;
    const auto take = [&] {
      for (const auto& bytes : order.take()) times.push_back(time_of(bytes));
    };
    for (const auto& [place, number] : arrivals) {
      ASSERT_TRUE(order.add(packet(number * kMillisecond), place * kMillisecond));
      order.advance(place * kMillisecond);
      take();
    }
    order.flush();
    take();
    EXPECT_EQ(order.counts().lost, missing);
    EXPECT_EQ(order.counts().duplicates, doubled);
    EXPECT_GT(order.counts().reordered, 0U);
    EXPECT_EQ(order.counts().late, 0U);
    EXPECT_EQ(times.size(), kCount - missing);
    EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
    EXPECT_EQ(std::adjacent_find(times.begin(), times.end()), times.end());
  }
}

TEST(PacketOrder, InertialSamplesDoNotDisturbPoints) {
  PacketOrder order(7);
  for (std::int64_t i = 0; i < 1000; ++i) {
    ASSERT_TRUE(order.add(packet(i * 400 * kMicrosecond, 2), i));
    if (i % 13 == 0) {
      ASSERT_TRUE(order.add(packet(i / 13 * 5 * kMillisecond, 6), i));
    }
  }
  order.flush();
  EXPECT_EQ(order.counts().lost, 0U);
  EXPECT_EQ(order.counts().packets, 1077U);
}

TEST(PacketOrder, WhatIsNoPacketIsRejected) {
  PacketOrder order(1);
  const auto good = packet(0);
  for (const std::size_t length : {std::size_t{0}, std::size_t{17}, good.size() - 1}) {
    EXPECT_FALSE(order.add(std::span(good).first(length), 0));
  }
  auto bad = good;
  bad.push_back(0);
  EXPECT_FALSE(order.add(bad, 0));
  for (const auto& [at, value] : {std::pair{0, 4}, {9, 9}, {9, 2}, {8, 9}}) {
    bad = good;
    bad[static_cast<std::size_t>(at)] = static_cast<std::uint8_t>(value);
    EXPECT_FALSE(order.add(bad, 0)) << at;
  }
  bad = good;  // a return at an angle of more than a turn, which no file could be read with
  bad[18] = 1;
  bad[23] = 0xFF;
  EXPECT_FALSE(order.add(bad, 0));
  EXPECT_EQ(order.counts().rejected, 9U);
  order.flush();
  EXPECT_TRUE(order.take().empty());
}

TEST(PacketOrder, ASensorThatComesBack) {
  PacketOrder order(1);
  const auto run = [&](std::int64_t from_ms, std::int64_t to_ms, std::int64_t host_ms) {
    for (std::int64_t i = from_ms; i < to_ms; ++i, ++host_ms) {
      ASSERT_TRUE(order.add(packet(i * kMillisecond), host_ms * kMillisecond));
    }
  };
  run(0, 1000, 0);
  order.flush();
  run(5000, 6000, 5000);  // its clock went on
  order.flush();
  run(0, 500, 9000);  // switched off and on
  order.flush();
  run(100, 400, 12'000);  // and again, which its clock hardly shows
  order.flush();
  EXPECT_EQ(order.counts().lost, 0U);  // whether it sent any meanwhile is unknown
  EXPECT_EQ(order.counts().clock_jumps, 2U);
  EXPECT_EQ(order.counts().packets, 2800U);
  ASSERT_EQ(order.gaps().size(), 3U);
  EXPECT_EQ(order.gaps()[0].lost, 4000U);
  EXPECT_EQ(order.gaps()[0].cause, GapCause::session);
  EXPECT_EQ(order.gaps()[1].cause, GapCause::clock);
  EXPECT_EQ(order.gaps()[0].host_from_ns, 999 * kMillisecond);
  EXPECT_EQ(order.gaps()[0].host_to_ns, 5000 * kMillisecond);
  EXPECT_FALSE(order.gaps()[1].lost);
  EXPECT_FALSE(order.gaps()[2].lost);
}

TEST(PacketOrder, AClockThatIsSet) {
  PacketOrder order(1);
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(order.add(packet(i * kMillisecond), i * kMillisecond));
  }
  constexpr std::int64_t kLate = 1'700'000'000 * kSecond;
  for (int i = 100; i < 200; ++i) {  // the same type, another time
    ASSERT_TRUE(order.add(packet(kLate + i * kMillisecond), i * kMillisecond));
  }
  for (int i = 200; i < 300; ++i) {  // another type
    ASSERT_TRUE(order.add(packet(kLate + i * kMillisecond, 1, 1), i * kMillisecond));
  }
  order.flush();
  EXPECT_EQ(order.counts().packets, 300U);
  EXPECT_EQ(order.counts().lost, 0U);
  EXPECT_EQ(order.counts().clock_jumps, 2U);
}

/// A packet that no other is equal to.
std::vector<std::uint8_t> marked(std::int64_t time_ns, std::int64_t number,
                                 std::uint8_t timestamp_type = 0) {
  auto bytes = packet(time_ns, 1, timestamp_type);
  io::store<std::int32_t>(&bytes[kPacketHeaderBytes], static_cast<std::int32_t>(number + 1));
  return bytes;
}

// While packets are lost, and come up to 5 ms late, as on a busy machine.
TEST(PacketOrder, AClockThatJumpsIsNoLoss) {
  constexpr std::int64_t kAt = 3000, kMs = kMillisecond;
  for (const std::uint8_t type : {std::uint8_t{0}, std::uint8_t{1}, std::uint8_t{4}}) {
    for (const std::int64_t jump_ms : {20, 250, 700, 5000, -200, -250, -700, -3000}) {
      SCOPED_TRACE(::testing::Message() << int{type} << ", " << jump_ms);
      PacketOrder order(1);
      std::mt19937 random(static_cast<unsigned>(jump_ms));
      std::uint64_t lost = 0, sent = 0;
      for (std::int64_t i = 0; i < 6000; ++i) {
        const std::int64_t time = 7'000'000 * kMs + (i + (i < kAt ? 0 : jump_ms)) * kMs;
        const bool kept = i == 0 || i == kAt - 1 || i == kAt || i == 5999;
        if (!kept && random() % 100 == 0) {
          ++lost;
          continue;
        }
        ++sent;
        ASSERT_TRUE(order.add(marked(time, i, type), i * kMs + random() % 5 * kMs / 5));
      }
      order.flush();
      EXPECT_EQ(order.counts().packets, sent);
      EXPECT_EQ(order.counts().lost, lost);
      EXPECT_EQ(order.counts().late, 0U);
      EXPECT_EQ(order.counts().duplicates, 0U);
      // Whole seconds are nothing to a clock that begins again every second.
      const bool seen = type != 4 || jump_ms % 1000 != 0;
      EXPECT_EQ(order.counts().clock_jumps, seen ? 1U : 0U);
      EXPECT_EQ(order.clock().stretches().size(), seen ? 2U : 1U);
    }
  }
}

TEST(PacketOrder, SecondsOfSilenceOfAPpsClock) {
  PacketOrder order(1);
  for (std::int64_t i = 0; i < 9000; ++i) {
    if (i > 2500 && i < 6800) continue;
    ASSERT_TRUE(order.add(marked(i * kMillisecond, i, 4), i * kMillisecond));
  }
  order.flush();
  EXPECT_EQ(order.counts().lost, 4299U);
  EXPECT_EQ(order.counts().clock_jumps, 0U);
}

// A queue that is emptied at once: what was dropped in it is lost, whenever the others come.
TEST(PacketOrder, LossInAQueueIsNoJump) {
  PacketOrder order(1);
  for (std::int64_t i = 0; i < 9000; ++i) {
    const bool queued = i > 4000 && i < 4300;
    if (queued && i % 3 == 0) continue;
    ASSERT_TRUE(order.add(marked(i * kMillisecond, i), (queued ? 4300 : i) * kMillisecond));
  }
  order.flush();
  EXPECT_EQ(order.counts().lost, 100U);  // 4002, 4005 to 4299
  EXPECT_EQ(order.counts().clock_jumps, 0U);
}

// Firmware of the Mid-40 that stores several returns as so many records.
TEST(PacketOrder, SpecialFirmwareHasOtherPeriods) {
  PacketOrder dual(1);
  dual.set_grid({10'000, 1, 1, 2});
  PacketOrder triple(1);
  triple.set_grid({50'000, 3, 1, 3});
  for (std::int64_t i = 0; i < 1000; ++i) {
    if (i % 10 == 5) continue;
    ASSERT_TRUE(dual.add(packet(i * 500 * kMicrosecond), i));
    ASSERT_TRUE(triple.add(packet(i * 34 * 50'000 / 3), i));
  }
  dual.flush();
  triple.flush();
  EXPECT_EQ(dual.counts().lost, 100U);
  EXPECT_EQ(triple.counts().lost, 100U);
}

// A stream that only leaves gaps keeps no more than it says.
TEST(PacketOrder, GapsAreLimited) {
  PacketOrder order(1);
  for (std::int64_t i = 0; i < 3000; ++i) {
    ASSERT_TRUE(order.add(packet(i * 200 * kMillisecond), i * 200 * kMillisecond));
  }
  order.flush();
  EXPECT_EQ(order.gaps().size(), PacketOrder::kMostGaps);
  EXPECT_EQ(order.counts().lost, 2999U * 199U);
}

}  // namespace risley::recordings::livox::order_test
