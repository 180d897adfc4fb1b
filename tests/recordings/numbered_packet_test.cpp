// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/numbered_packet.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/recordings/livox/numbered_order.hpp"
#include "risley/recordings/livox/packet_encoder.hpp"

#include "recordings/numbered_packets.hpp"
#include "wire/hex.hpp"

namespace risley::recordings::livox::numbered_packet_test {

using namespace numbered_packets;
using ::testing::ElementsAre;
using wire::bytes_of;

constexpr std::int64_t kTime = 1'700'000'000'123'456'789;

struct KnownPacket {
  std::uint8_t data_type;
  const char* bytes;
};
constexpr KnownPacket kKnown[] = {
    {1,
     "004000 3200 0200 0700 000101 000000000000000000000000 AC75BDD8 15CD853DFE9C9717 "
     "D2040000D2E9FFFF840300002A15 0000000000000000000000003C00"},
    {2,
     "003400 3200 0200 0700 000201 000000000000000000000000 606CA761 15CD853DFE9C9717 "
     "7B00C8FD5A002A15 0000000000003C00"},
    {3,
     "003800 3200 0200 FFFF 000300 000000000000000000000000 1658240C 15CD853DFE9C9717 "
     "F9160000B71F426E2A00 00000000000000003C00"},
    {0x11,
     "004000 3200 0100 0700 001100 000000000000000000000000 D8A6DA97 15CD853DFE9C9717 "
     "D2040000D2E9FFFF840300002A15D2040000D2E9FFFF840300002A15"},
};

TEST(NumberedPacket, KnownPacketsBothWays) {
  for (const KnownPacket& known : kKnown) {
    SCOPED_TRACE(int{known.data_type});
    const auto bytes = bytes_of(known.bytes);
    Chunk chunk;
    decode_numbered_packet(bytes, kMid360, 3, chunk);
    const Observations& o = chunk.observations;
    ASSERT_EQ(o.size(), 2U);
    const bool two_returns = known.data_type == 0x11;
    EXPECT_THAT(o.time_ns, ElementsAre(kTime, kTime + (two_returns ? 0 : 5000)));
    EXPECT_THAT(o.device, ElementsAre(3, 3));
    if (two_returns) {
      EXPECT_THAT(o.return_number, ElementsAre(1, 2));
      EXPECT_THAT(o.beam, ElementsAre(0, 0));
    } else {
      EXPECT_THAT(o.beam, ElementsAre(0, 1));
      EXPECT_THAT(o.valid, ElementsAre(1, 0));
      EXPECT_THAT(o.intensity, ElementsAre(42, 60));
    }
    const double step = known.data_type == 2 ? 0.01 : 0.001;
    EXPECT_FLOAT_EQ(o.range_resolution[0], static_cast<float>(step));
    EXPECT_NEAR(o.range[0], std::hypot(1.234, 5.678, 0.9), 1.5 * step);
    EXPECT_NEAR(degrees_from_radians(o.azimuth[0]), -77.74, 0.15);
    EXPECT_NEAR(degrees_from_radians(o.zenith[0]), 81.19, 0.1);
    ASSERT_EQ(chunk.packets.size(), 1U);
    EXPECT_EQ(chunk.packets[0].version, kNumberedVersion);
    EXPECT_EQ(chunk.packets[0].number, known.data_type == 3 ? 65535U : 7U);
    EXPECT_EQ(chunk.packets[0].data_type, known.data_type);

    std::vector<std::uint8_t> again(bytes.size());
    const NumberedHeader header = decode_numbered_header(bytes);
    const RecordLayout layout = *numbered_layout(header.data_type, header.records);
    for (std::size_t record = 0; record < header.records; ++record) {
      encode_numbered_record(header.data_type, o, record * layout.returns, record,
                             &again[kNumberedHeaderBytes + record * layout.bytes_per_record]);
    }
    encode_numbered_header(header, again);
    EXPECT_EQ(again, bytes);
  }
}

TEST(NumberedPacket, InertialSampleBothWays) {
  const auto bytes = bytes_of(
      "003C00 0000 0100 0900 000000 000000000000000000000000 CEA9D073 00F2052A01000000 "
      "0AD7233C0AD7A3BC8FC2F53C00000000000000000000803F");
  Chunk chunk;
  decode_numbered_packet(bytes, kMid360, 1, chunk);
  ASSERT_EQ(chunk.imu.size(), 1U);
  EXPECT_EQ(chunk.imu[0].time_ns, 5'000'000'000);
  EXPECT_THAT(chunk.imu[0].angular_velocity, ElementsAre(0.01F, -0.02F, 0.03F));
  EXPECT_THAT(chunk.imu[0].acceleration_g, ElementsAre(0.0F, 0.0F, 1.0F));
  EXPECT_TRUE(chunk.packets.at(0).is_imu());
  std::vector<std::uint8_t> again(bytes.size());
  encode_imu(chunk.imu[0], &again[kNumberedHeaderBytes]);
  encode_numbered_header(decode_numbered_header(bytes), again);
  EXPECT_EQ(again, bytes);
}

TEST(NumberedPacket, WhatNoSensorSendsIsRefused) {
  const auto bytes = bytes_of(kKnown[0].bytes);
  const auto refuses = [&](std::size_t at, std::uint8_t value, std::size_t place) {
    auto changed = bytes;
    changed[at] = value;
    try {
      Chunk chunk;
      decode_numbered_packet(changed, kMid360, 0, chunk);
      ADD_FAILURE() << "byte " << at;
    } catch (const BadPacket& bad) {
      EXPECT_EQ(bad.byte_offset(), place);
    }
  };
  refuses(0, 5, 0);       // version
  refuses(1, 0x41, 1);    // length
  refuses(5, 3, 5);       // records that are not there
  refuses(10, 7, 10);     // data type
  refuses(35, 0xFF, 28);  // time
  // What varies is taken: fewer records than bytes, no checksum, no interval.
  for (const auto& [at, value] : {std::pair(5, 1), {3, 0}, {24, 0}, {12, 2}, {9, 1}}) {
    auto changed = bytes;
    changed[static_cast<std::size_t>(at)] = static_cast<std::uint8_t>(value);
    Chunk chunk;
    EXPECT_NO_THROW(decode_numbered_packet(changed, kMid360, 0, chunk)) << at;
    EXPECT_EQ(chunk.observations.size(), at == 5 ? 1U : 2U);
  }
}

TEST(NumberedPacket, ShotsEndWhereTheIntervalSays) {
  for (const auto& [interval, type, step] : {std::tuple(std::uint16_t{4750}, kMid360, 5000.0),
                                             {std::uint16_t{2102}, kHap, 210'200.0 / 95}}) {
    Chunk chunk;
    decode_numbered_packet(packet({.number = 1, .interval = interval}), type, 0, chunk);
    ASSERT_EQ(chunk.observations.size(), 96U);
    for (std::size_t i = 0; i < 96; ++i) {
      EXPECT_NEAR(static_cast<double>(chunk.observations.time_ns[i] - kStart),
                  static_cast<double>(i) * step, 0.51);
      EXPECT_EQ(chunk.observations.beam[i], i % (type == kHap ? 6 : 4));
    }
  }
}

/// The count of what comes of packets with these numbers and times.
PacketCounts counts_of(const std::vector<Sent>& sent) {
  NumberedOrder order;
  std::int64_t host_ns = 0;
  for (const Sent& one : sent) EXPECT_TRUE(order.add(packet(one), host_ns += 480'000));
  order.flush();
  return order.counts();
}

std::vector<Sent> stream(std::size_t packets, std::size_t first = 65'000) {
  std::vector<Sent> sent;
  for (std::size_t i = 0; i < packets; ++i) {
    sent.push_back({.number = static_cast<std::uint16_t>(first + i), .time_ns = time_of(i)});
  }
  return sent;
}

TEST(NumberedOrder, EveryFiftiethPacketIsMissed) {
  std::vector<Sent> sent = stream(2083);
  std::vector<Sent> received;
  for (std::size_t i = 0; i < sent.size(); ++i) {
    if (i % 50 != 49) received.push_back(sent[i]);
  }
  const PacketCounts counts = counts_of(received);
  EXPECT_EQ(counts.lost, 41U);
  EXPECT_EQ(counts.packets, 2042U);
  EXPECT_EQ(counts.duplicates + counts.reordered + counts.late, 0U);
}

TEST(NumberedOrder, DisorderAndDuplicatesAreMendedAndCounted) {
  std::vector<Sent> sent = stream(1000);
  std::mt19937 random(1);
  std::size_t doubled = 0;
  std::vector<Sent> received;
  for (std::size_t i = 0; i < sent.size(); ++i) {
    received.push_back(sent[i]);
    if (random() % 10 == 0) {
      received.push_back(sent[i]);
      ++doubled;
    }
  }
  for (std::size_t i = 0; i + 8 < received.size(); i += 8) {
    std::shuffle(received.begin() + static_cast<std::ptrdiff_t>(i),
                 received.begin() + static_cast<std::ptrdiff_t>(i + 8), random);
  }
  NumberedOrder order;
  for (const Sent& one : received) order.add(packet(one), 0);
  order.flush();
  EXPECT_EQ(order.counts().lost, 0U);
  EXPECT_EQ(order.counts().duplicates, doubled);
  EXPECT_EQ(order.counts().packets, 1000U);
  EXPECT_GT(order.counts().reordered, 0U);
  const auto given = order.take();
  ASSERT_EQ(given.size(), 1000U);
  for (std::size_t i = 0; i < given.size(); ++i) {
    EXPECT_EQ(decode_numbered_header(given[i]).time_ns, static_cast<std::uint64_t>(time_of(i)));
  }
}

TEST(NumberedOrder, LongGapsAreCountedByTimesWhereNumbersGoRound) {
  for (const std::size_t missing : {40'000U, 65'535U, 65'536U, 70'000U, 300'001U}) {
    std::vector<Sent> sent = stream(10);
    for (std::size_t i = 0; i < 10; ++i) {
      const std::size_t place = 10 + missing + i;
      sent.push_back(
          {.number = static_cast<std::uint16_t>(65'000 + place), .time_ns = time_of(place)});
    }
    EXPECT_EQ(counts_of(sent).lost, missing);
  }
}

TEST(NumberedOrder, ASensorThatBeginsAnewLosesNothing) {
  std::vector<Sent> sent = stream(100);
  for (std::size_t i = 0; i < 100; ++i) {
    sent.push_back({.number = static_cast<std::uint16_t>(i),
                    .time_ns = 3'000'000'000 + time_of(i) - time_of(0)});
  }
  const PacketCounts counts = counts_of(sent);
  EXPECT_EQ(counts.lost, 0U);
  EXPECT_EQ(counts.clock_jumps, 1U);
  EXPECT_EQ(counts.packets, 200U);
}

TEST(NumberedOrder, AfterAPauseAnyTimeThatGoesBackIsANewBeginning) {
  NumberedOrder order;
  std::int64_t host_ns = 0;
  const auto take = [&](std::size_t place, std::size_t number) {
    order.add(packet({.number = static_cast<std::uint16_t>(number), .time_ns = time_of(place)}),
              host_ns += 480'000);
  };
  order.flush();  // before there is one
  for (const std::size_t place : {3U, 1U, 2U, 4U, 5U}) take(place, place);
  order.flush();
  for (const std::size_t place : {2U, 1U, 3U}) take(place, place + 500);
  order.flush();
  EXPECT_EQ(order.counts().packets, 8U);
  EXPECT_EQ(order.counts().lost, 0U);
  EXPECT_EQ(order.counts().clock_jumps, 1U);
  ASSERT_EQ(order.gaps().size(), 1U);
  EXPECT_EQ(order.gaps()[0].cause, GapCause::clock);
  EXPECT_FALSE(order.gaps()[0].lost);
}

TEST(NumberedOrder, ASensorThatBeginsAnewSoonLosesNothing) {
  for (const std::size_t back : {1U, 100U, 400U}) {  // packets, by which its time is less
    std::vector<Sent> sent = stream(500, 0);
    for (std::size_t i = 0; i < 500; ++i) {
      sent.push_back({.number = static_cast<std::uint16_t>(i), .time_ns = time_of(500 - back + i)});
    }
    const PacketCounts counts = counts_of(sent);
    EXPECT_EQ(counts.packets, 1000U);
    EXPECT_EQ(counts.lost + counts.duplicates + counts.late, 0U);
    EXPECT_EQ(counts.clock_jumps, 1U);
  }
}

TEST(NumberedOrder, ClocksThatJumpLoseNothing) {
  NumberedOrder order;
  std::int64_t host_ns = 0;
  for (std::size_t i = 0; i < 300; ++i) {
    if (i == 50) continue;
    const std::int64_t jumped = i < 100 ? 0 : i < 200 ? 250'000'000 : -300'000'000;
    order.add(packet({.number = static_cast<std::uint16_t>(i),
                      .time_ns = 10'000'000'000 + time_of(i) - time_of(0) + jumped}),
              host_ns += 480'000);
  }
  order.flush();
  EXPECT_EQ(order.counts().lost, 1U);
  EXPECT_EQ(order.counts().clock_jumps, 2U);
  EXPECT_EQ(order.clock().stretches().size(), 3U);
  for (const PacketGap& gap : order.gaps()) EXPECT_EQ(gap.lost, 0U);
}

TEST(NumberedOrder, AClockThatIsSetLosesNothingHoweverFarItGoes) {
  constexpr std::int64_t kLate = 9'000'000'000'000'000'000;  // ns
  for (const std::int64_t period : {std::int64_t{1}, std::int64_t{480'000}, kLate / 300}) {
    std::vector<Sent> sent;
    for (std::size_t i = 0; i < 300; ++i) {
      const auto place = static_cast<std::int64_t>(i);
      const std::int64_t set = i % 3 == 0 ? 0 : kLate;
      sent.push_back({.number = static_cast<std::uint16_t>(i),
                      .time_ns = i < 10 ? place * period : set + place});
    }
    const PacketCounts counts = counts_of(sent);
    EXPECT_EQ(counts.packets, 300U);
    EXPECT_EQ(counts.lost, 0U);
    EXPECT_GT(counts.clock_jumps, 100U);
  }
}

TEST(NumberedOrder, NumbersThatBeginAnewWithEveryFrame) {
  std::vector<Sent> sent;
  for (std::size_t i = 0; i < 400; ++i) {
    if (i == 200 || i == 201 || i == 350) continue;  // the first two of a frame, and another
    sent.push_back({.number = static_cast<std::uint16_t>(i % 200),
                    .time_ns = time_of(i),
                    .frame = static_cast<std::uint8_t>(i / 200)});
  }
  EXPECT_EQ(counts_of(sent).lost, 3U);
}

TEST(NumberedOrder, NoDisorderIsInventedWhereAWriterNumbersNothing) {
  std::vector<Sent> sent = stream(100);
  for (Sent& one : sent) one.number = 0;
  const PacketCounts counts = counts_of(sent);
  EXPECT_EQ(counts.packets, 100U);
  EXPECT_EQ(counts.lost + counts.duplicates + counts.late, 0U);
}

TEST(TagWords, SayWhatIsInDoubt) {
  EXPECT_EQ(tag_words(kMid360, 0), "a good point");
  EXPECT_EQ(tag_words(kMid360, 0xC0), "a good point");  // reserved bits
  EXPECT_THAT(tag_words(kMid360, 0x15), ::testing::HasSubstr("medium"));
  EXPECT_THAT(tag_words(kMid360, 0x20), ::testing::HasSubstr("low"));
}

}  // namespace risley::recordings::livox::numbered_packet_test
