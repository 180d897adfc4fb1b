// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/packet_decoder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/recordings/reader.hpp"

#include "recordings/format_tests.hpp"
#include "recordings/lvx_bytes.hpp"
#include "refusal.hpp"

// Which rows come out of which bytes is tested in packet_test.cpp, through files; here, what a live
// receiver relies on.
namespace risley::recordings::livox::packet_decoder_test {

using namespace lvx_bytes;
using ::testing::HasSubstr;

constexpr std::uint8_t kMid40 = 1, kHorizon = 3, kAvia = 7;

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// The bytes that a sensor would send: a package of LVX without its device index.
std::string packet(std::uint8_t data_type, std::uint64_t time, std::mt19937& random,
                   std::uint8_t timestamp_type = 0) {
  return package(0, timestamp_type, data_type, time, random).substr(1);
}

void expect_bad(PacketDecoder& decoder, const std::string& bytes, std::size_t byte_offset,
                const char* problem) {
  SCOPED_TRACE(problem);
  std::mt19937 random(7);
  Chunk chunk;
  PacketDecoder({.device_type = kAvia}).decode(bytes_of(packet(2, 5, random)), chunk);
  try {
    decoder.decode(bytes_of(bytes), chunk);
    FAIL() << "was accepted";
  } catch (const BadPacket& bad) {
    EXPECT_EQ(bad.byte_offset(), byte_offset);
    EXPECT_THAT(bad.problem(), HasSubstr(problem));
    EXPECT_THAT(bad.what(), HasSubstr(std::to_string(byte_offset)));
  }
  EXPECT_EQ(chunk.observations.size(), 96U);
  EXPECT_EQ(chunk.packets.size(), 1U);
  EXPECT_TRUE(chunk.imu.empty());
}

TEST(PacketDecoder, GivesTheRowsThatAFileOfThePacketsGives) {
  std::mt19937 random(3);
  std::vector<std::string> packages;
  for (const int data_type : {2, 3, 6, 4, 5, 7, 8}) {
    packages.push_back(package(0, 0, static_cast<std::uint8_t>(data_type),
                               static_cast<std::uint64_t>(1000 * data_type), random));
  }
  std::string file = header_lvx11({{"3JEDK1E001F6361", 0, kAvia}});
  put_frame(file, packages, 0);
  const TestFolder folder;
  format_tests::put_bytes(folder.file("in.lvx"), file);
  const Recording recording = load_recording(folder.file("in.lvx"));

  PacketDecoder decoder({.device_type = kAvia});
  Chunk chunk;
  for (const std::string& one : packages) decoder.decode(bytes_of(one).subspan(1), chunk);
  const Observations &live = chunk.observations, &stored = recording.data.observations;
  EXPECT_EQ(live.time_ns, stored.time_ns);
  EXPECT_EQ(live.range, stored.range);
  EXPECT_EQ(live.intensity, stored.intensity);
  EXPECT_EQ(live.return_number, stored.return_number);
  EXPECT_EQ(live.tag, stored.tag);
  EXPECT_EQ(live.beam, stored.beam);
  EXPECT_EQ(live.valid, stored.valid);
  ASSERT_EQ(chunk.packets.size(), recording.data.packets.size());
  for (std::size_t i = 0; i < chunk.packets.size(); ++i) {
    EXPECT_EQ(chunk.packets[i].rows, recording.data.packets[i].rows);
    EXPECT_EQ(chunk.packets[i].timestamp, recording.data.packets[i].timestamp);
  }
  ASSERT_EQ(chunk.imu.size(), 1U);
  EXPECT_EQ(chunk.imu[0].time_ns, 6000);
  EXPECT_EQ(chunk.imu[0].angular_velocity, recording.data.imu[0].angular_velocity);
}

TEST(PacketDecoder, NumbersTheSixBeamsOfAHorizon) {
  std::mt19937 random(4);
  PacketDecoder decoder({.device_type = kHorizon, .device = 5});
  Chunk chunk;
  decoder.decode(bytes_of(packet(2, 1'000'000, random)), chunk);
  for (std::size_t row = 0; row < 96; ++row) {
    EXPECT_EQ(chunk.observations.beam[row], row % 6);
    EXPECT_EQ(chunk.observations.device[row], 5);
    EXPECT_EQ(chunk.observations.time_ns[row],
              1'000'000 + std::llround(static_cast<double>(row) * 1e9 / 240e3));
  }
  EXPECT_EQ(chunk.packets[0].device_index, 5);
}

TEST(PacketDecoder, AChunkThatIsUsedAgainNeedsNoMoreMemory) {
  std::mt19937 random(5);
  const std::string one = packet(3, 1000, random);
  PacketDecoder decoder({.device_type = kHorizon});
  Chunk chunk;
  decoder.decode(bytes_of(one), chunk);
  const auto* const first = chunk.observations.azimuth.data();
  const std::size_t room = chunk.observations.azimuth.capacity();
  for (int i = 0; i < 100; ++i) {
    chunk.clear();
    decoder.decode(bytes_of(one), chunk);
  }
  EXPECT_EQ(chunk.observations.azimuth.data(), first);
  EXPECT_EQ(chunk.observations.azimuth.capacity(), room);
}

TEST(PacketDecoder, PutsRowsIntoColumnsThatHaveRoomForThem) {
  std::mt19937 random(8);
  const std::string first = packet(3, 1000, random), second = packet(3, 2000, random);
  PacketDecoder decoder({.device_type = kHorizon});
  Chunk appended, filled;
  decoder.decode(bytes_of(first), appended);
  decoder.decode(bytes_of(second), appended);
  filled.observations.resize(200);
  std::fill(filled.observations.range.begin(), filled.observations.range.end(), -1.0);
  decoder.decode_into(bytes_of(first), filled, 0);
  decoder.decode_into(bytes_of(second), filled, 96);
  EXPECT_EQ(filled.packets.size(), 2U);
  EXPECT_EQ(filled.observations.range[192], -1.0);
  filled.observations.resize(192);
  EXPECT_EQ(filled.observations.azimuth, appended.observations.azimuth);
  EXPECT_EQ(filled.observations.zenith, appended.observations.zenith);
  EXPECT_EQ(filled.observations.range, appended.observations.range);
  EXPECT_EQ(filled.observations.time_ns, appended.observations.time_ns);
  EXPECT_EQ(filled.observations.range_resolution, appended.observations.range_resolution);
  EXPECT_THROW(decoder.decode_into(bytes_of(first), filled, 97), InvalidArgument);
  EXPECT_EQ(filled.packets.size(), 2U);
}

TEST(PacketDecoder, NamesTheByteOfWhatIsWrong) {
  std::mt19937 random(6);
  PacketDecoder decoder({.device_type = kMid40});
  const std::string good = packet(1, 1000, random);
  expect_bad(decoder, "", 0, "expected a packet header of 18 bytes");
  expect_bad(decoder, good.substr(0, 17), 17, "found 17");
  expect_bad(decoder, good.substr(0, 100), 100, "expected 900 bytes of records, found 82");
  expect_bad(decoder, good + "x", 918, "found 901");
  std::string bad = good;
  bad[0] = 6;
  expect_bad(decoder, bad, 0, "version = 6, expected 5");
  bad = good;
  bad[9] = 9;
  expect_bad(decoder, bad, 9, "data type = 9");
  bad = good;
  bad[8] = 6;
  expect_bad(decoder, bad, 8, "are not a time stamp of type 6");
  bad = good;
  put_at(bad, 10, ~std::uint64_t{0});
  expect_bad(decoder, bad, 8, "are not a time stamp");
  bad = good;
  put_at(bad, 18 + 3 * 9, std::uint32_t{1});
  put_at(bad, 18 + 3 * 9 + 4, std::uint16_t{18'001});
  expect_bad(decoder, bad, 18 + 3 * 9, "[0, 18000]");
}

TEST(PacketDecoder, RefusesNumbersThatAreNone) {
  std::mt19937 random(8);
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
    PacketDecoder avia({.device_type = kAvia});
    std::string inertial = packet(6, 1000, random);
    put_at(inertial, 18 + 16, value);
    expect_bad(avia, inertial, 18 + 16, "finite");

    PacketDecoder old({.device_type = kMid40, .float_points = true});
    std::string points = packet(0, 1000, random);
    for (int i = 0; i < 100; ++i) {
      for (int axis = 0; axis < 3; ++axis) put_at(points, 18 + 13 * i + 4 * axis, 1.5F);
    }
    Chunk chunk;
    old.decode(bytes_of(points), chunk);
    EXPECT_DOUBLE_EQ(chunk.observations.range[99], std::sqrt(3.0) * 1.5);
    put_at(points, 18 + 13 * 7 + 8, value);
    expect_bad(old, points, 18 + 13 * 7, "finite");
  }
}

TEST(PacketDecoder, AsksForTheGridOfUnknownDevices) {
  std::mt19937 random(9);
  const std::string one = packet(2, 1000, random);
  Chunk chunk;
  try {
    PacketDecoder({.device_type = 200}).decode(bytes_of(one), chunk);
    FAIL() << "an unknown shot rate was accepted";
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), NamesField("device type"));
  }
  EXPECT_EQ(chunk.observations.size(), 0U);
  PacketDecoder({.device_type = 200, .grid = kGrid240kHz}).decode(bytes_of(one), chunk);
  EXPECT_EQ(chunk.observations.beam[5], 5);
  for (const ShotGrid& grid : {ShotGrid{1, 0, 1, 1}, ShotGrid{1, 1, 0, 1}, ShotGrid{1, 1, 1, 0}}) {
    EXPECT_THROW(PacketDecoder({.grid = grid}), InvalidArgument);
    Observations rows;
    EXPECT_THROW(decode_records(*record_layout(2), bytes_of(one).subspan(18), 0, grid, 0, rows),
                 InvalidArgument);
  }
}

TEST(PacketDecoder, RecordsAloneMustFitTheirLayout) {
  std::mt19937 random(10);
  const std::string one = packet(8, 1000, random);
  const auto records = bytes_of(one).subspan(18);
  Observations rows;
  decode_records(*record_layout(8), records, 7, kGrid240kHz, 2, rows);
  EXPECT_EQ(rows.size(), 90U);
  EXPECT_THROW(decode_records(*record_layout(8), records.first(10), 7, kGrid240kHz, 2, rows),
               BadPacket);
  RecordLayout odd = *record_layout(8);
  odd.bytes_per_record = 21;
  EXPECT_THROW(decode_records(odd, records, 7, kGrid240kHz, 2, rows), InvalidArgument);
  EXPECT_THROW(decode_records(*record_layout(6), records, 7, kGrid240kHz, 2, rows),
               InvalidArgument);
  EXPECT_EQ(rows.size(), 90U);
}

/// Seconds after the first PPS edge at which a clock sees these counts; -1 for no time.
std::vector<double> pps_seconds(const std::vector<std::uint64_t>& since_edge_ns) {
  PacketClock clock;
  std::vector<double> seconds;
  for (const std::uint64_t count : since_edge_ns) {
    Packet packet;
    packet.timestamp_type = 4;
    std::memcpy(packet.timestamp.data(), &count, sizeof count);
    const auto time = clock.time_ns(packet);
    seconds.push_back(time ? static_cast<double>(*time) * 1e-9 : -1.0);
  }
  return seconds;
}

TEST(PacketClock, PpsStampsOfAnySizeDoNotOverflow) {
  constexpr std::uint64_t kHuge = 9'223'000'000'000'000'000;
  const auto seconds = pps_seconds({0, 500'000'000, 0, kHuge, 0, kHuge, 0, kHuge, 0});
  EXPECT_THAT(std::vector<double>(seconds.begin(), seconds.begin() + 3),
              ::testing::ElementsAre(0.0, 0.5, 1.0));
  EXPECT_DOUBLE_EQ(seconds[3], 9'223'000'001.0);
  EXPECT_DOUBLE_EQ(seconds[4], 9'223'000'001.0);  // the edge that ends that second
  EXPECT_EQ(seconds[5], -1.0);
  EXPECT_DOUBLE_EQ(seconds[6], 9'223'000'001.0);  // as before what was no time
}

TEST(ShotGrid, CountsFurtherThan32Bits) {
  EXPECT_EQ(kGrid240kHz.offset_ns(1'000'000), 4'166'666'667);
  EXPECT_EQ(kGrid100kHz.offset_ns(1'000'000), 10'000'000'000);
}

}  // namespace risley::recordings::livox::packet_decoder_test
