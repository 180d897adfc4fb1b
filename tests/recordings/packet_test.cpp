// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>
#include <functional>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/writer.hpp"

#include "recordings/format_tests.hpp"
#include "recordings/lvx_bytes.hpp"

// Packets are tested through the files that hold them: what counts is which rows come out of which
// bytes and which bytes out of which rows.
namespace risley::recordings::packet_test {

using namespace lvx_bytes;

constexpr std::uint8_t kMid40 = 1, kHorizon = 3, kMid70 = 6, kAvia = 7;

/// One package of these records in a file of one device.
std::string one_package_file(std::uint8_t device_type, std::uint8_t data_type, std::string body,
                             std::uint8_t timestamp_type = 0, std::uint64_t time = 0) {
  body.resize(kTypes[data_type].records * kTypes[data_type].bytes_per_record, '\0');
  std::string file = header_lvx11({{"1PQDG3B006H2Z11", 0, device_type}});
  put_frame(file, {package_header(0, timestamp_type, data_type, time) + body}, 0);
  return file;
}

class PacketTest : public ::testing::Test {
 protected:
  Recording load(const std::string& bytes) {
    format_tests::put_bytes(folder_.file("in.lvx"), bytes);
    return load_recording(folder_.file("in.lvx"));
  }

  std::string write(const Recording& recording) {
    std::filesystem::remove(folder_.file("out.lvx"));
    const auto writer = create_recording(folder_.file("out.lvx"), recording.header);
    writer->write(recording.data);
    writer->close();
    return format_tests::get_bytes(folder_.file("out.lvx"));
  }

  /// Writes and checks that the same bytes come out.
  void expect_same_bytes(const std::string& bytes) { EXPECT_TRUE(write(load(bytes)) == bytes); }

  TestFolder folder_;
};

TEST_F(PacketTest, SphericalRecordsGiveAzimuthZenithAndRange) {
  std::string body = spherical_record(1, 9000, 0, {1}, 7, 0);
  body += spherical_record(1, 0, 18000, {4294967295U}, 255, 0);
  body += spherical_record(1, 18000, 18001, {12345}, 0, 0);
  body += spherical_record(1, 8999, 35999, {1000}, 150, 0);
  body += spherical_record(1, 4500, 27000, {0}, 3, 0);
  const Recording recording = load(one_package_file(kMid40, 1, body));
  const Observations& o = recording.data.observations;
  ASSERT_EQ(o.size(), 100U);
  const double azimuth_deg[] = {0, 180, -179.99, -0.01, -90},
               zenith_deg[] = {90, 0, 180, 89.99, 45};
  const double range[] = {0.001, 4294967.295, 12.345, 1.0, 0.0};
  for (std::size_t i = 0; i < 5; ++i) {
    SCOPED_TRACE(i);
    EXPECT_NEAR(degrees_from_radians(o.azimuth[i]), azimuth_deg[i], 1e-12);
    EXPECT_NEAR(degrees_from_radians(o.zenith[i]), zenith_deg[i], 1e-12);
    EXPECT_NEAR(o.range[i], range[i], 1e-9);
    EXPECT_EQ(o.valid[i], i < 4 ? 1 : 0);
    EXPECT_EQ(o.time_ns[i], static_cast<std::int64_t>(i) * 10'000);
  }
  EXPECT_LE(o.azimuth[1], kPi);
  EXPECT_FLOAT_EQ(o.azimuth_resolution[0], static_cast<float>(0.01 * kRadiansPerDegree));
  EXPECT_FLOAT_EQ(o.zenith_resolution[0], static_cast<float>(0.01 * kRadiansPerDegree));
  EXPECT_FLOAT_EQ(o.range_resolution[0], 0.001F);
  EXPECT_THAT(std::vector<int>(o.intensity.begin(), o.intensity.begin() + 5),
              ::testing::ElementsAre(7, 255, 0, 150, 3));
}

TEST_F(PacketTest, CartesianRecordsGiveAnglesOfTheirAxes) {
  std::string body;
  const std::int32_t points[][3] = {{2000, 0, 0}, {0, 3000, 0}, {0, 0, 4000}, {-5000, 0, 0},
                                    {0, -10, 0},  {0, 0, -7},   {0, 0, 0}};
  for (const auto& point : points) {
    for (const std::int32_t coordinate : point) put(body, coordinate);
    put(body, std::uint8_t{9});
  }
  const Recording recording = load(one_package_file(kMid40, 0, body));
  EXPECT_TRUE(recording.header.cartesian);
  const Observations& o = recording.data.observations;
  const double azimuth[] = {0, kPi / 2, 0, kPi, -kPi / 2, 0};
  const double zenith[] = {kPi / 2, kPi / 2, 0, kPi / 2, kPi / 2, kPi};
  const double range[] = {2, 3, 4, 5, 0.01, 0.007};
  for (std::size_t i = 0; i < 6; ++i) {
    SCOPED_TRACE(i);
    EXPECT_NEAR(o.azimuth[i], azimuth[i], 1e-15);
    EXPECT_NEAR(o.zenith[i], zenith[i], 1e-15);
    EXPECT_NEAR(o.range[i], range[i], 1e-12);
    EXPECT_EQ(o.valid[i], 1);
  }
  EXPECT_FLOAT_EQ(o.azimuth_resolution[0], 0.0005F);  // 1 mm at 2 m
  EXPECT_FLOAT_EQ(o.zenith_resolution[2], 0.00025F);
  EXPECT_FLOAT_EQ(o.azimuth_resolution[2], static_cast<float>(kTwoPi));
  EXPECT_FLOAT_EQ(o.range_resolution[0], 0.001F);
  EXPECT_EQ(o.valid[6], 0);
  EXPECT_EQ(o.range[6], 0.0);
  EXPECT_TRUE(std::isnan(o.azimuth[6]) && std::isnan(o.zenith[6]));
  EXPECT_EQ(o.intensity[6], 9);
}

struct LayoutCase {
  std::uint8_t device_type, data_type;
  std::size_t rows, package_bytes;
  int returns;
  bool cartesian;
};

TEST_F(PacketTest, EveryDataTypeHasItsSizeReturnsTimesAndBeams) {
  const LayoutCase cases[] = {
      {kMid40, 0, 100, 1319, 1, true},  {kMid40, 1, 100, 919, 1, false},
      {kMid70, 2, 96, 1363, 1, true},   {kMid70, 3, 96, 979, 1, false},
      {kHorizon, 4, 96, 1363, 2, true}, {kHorizon, 5, 96, 787, 2, false},
      {kAvia, 7, 90, 1279, 3, true},    {kAvia, 8, 90, 679, 3, false},
      {kAvia, 6, 0, 43, 1, false},
  };
  std::mt19937 random(1);
  for (const LayoutCase& c : cases) {
    SCOPED_TRACE(int{c.data_type});
    const std::string file =
        one_package_file(c.device_type, c.data_type, records(c.data_type, random), 0, 5'000'000);
    ASSERT_EQ(file.size(), 88 + 24 + c.package_bytes);
    const Recording recording = load(file);
    const Observations& o = recording.data.observations;
    ASSERT_EQ(o.size(), c.rows);
    ASSERT_EQ(recording.data.packets.size(), 1U);
    EXPECT_EQ(recording.data.packets[0].rows, c.rows);
    EXPECT_EQ(recording.data.packets[0].status, 0x8200U);
    EXPECT_EQ(recording.header.returns_per_shot, c.returns);
    EXPECT_EQ(recording.header.cartesian, c.cartesian);
    EXPECT_TRUE(recording.warnings.empty());
    const bool fast = c.device_type == kHorizon || c.device_type == kAvia;
    for (std::size_t row = 0; row < o.size(); ++row) {
      const auto shot = static_cast<double>(row / static_cast<std::size_t>(c.returns));
      const double expected = shot * 1e9 / (fast ? 240'000.0 : 100'000.0);
      ASSERT_EQ(o.time_ns[row], 5'000'000 + std::llround(expected)) << row;
      ASSERT_EQ(o.beam[row], fast ? static_cast<int>(shot) % 6 : 0);
      ASSERT_EQ(o.return_number[row], row % static_cast<std::size_t>(c.returns) + 1);
      ASSERT_EQ(o.valid[row] != 0, o.range[row] > 0);
    }
    expect_same_bytes(file);
  }
}

TEST_F(PacketTest, TheTimesOfSixBeamsAreRoundedAndDoNotDrift) {
  std::mt19937 random(1);
  const Recording recording = load(one_package_file(kHorizon, 3, records(3, random)));
  const auto& time = recording.data.observations.time_ns;
  EXPECT_THAT(std::vector<std::int64_t>(time.begin(), time.begin() + 5),
              ::testing::ElementsAre(0, 4167, 8333, 12500, 16667));
  EXPECT_EQ(time[95], 395'833);
}

TEST_F(PacketTest, SeveralReturnsShareTheirAnglesAndKeepTheirTags) {
  std::string body = spherical_record(8, 9100, 350, {5000, 0, 7000}, 20, 0x1A);
  body += spherical_record(8, 9200, 360, {0, 0, 0}, 0, 0);
  const Recording recording = load(one_package_file(kAvia, 8, body));
  const Observations& o = recording.data.observations;
  for (std::size_t row = 0; row < 3; ++row) {
    EXPECT_NEAR(degrees_from_radians(o.zenith[row]), 91.0, 1e-12);
    EXPECT_NEAR(degrees_from_radians(o.azimuth[row]), 3.5, 1e-12);
    EXPECT_EQ(o.tag[row], 0x1A);
  }
  EXPECT_THAT(std::vector<double>(o.range.begin(), o.range.begin() + 6),
              ::testing::ElementsAre(5.0, 0.0, 7.0, 0.0, 0.0, 0.0));
  EXPECT_THAT(std::vector<int>(o.valid.begin(), o.valid.begin() + 6),
              ::testing::ElementsAre(1, 0, 1, 0, 0, 0));
  EXPECT_NEAR(degrees_from_radians(o.zenith[3]), 92.0, 1e-12);  // kept, not trusted
}

TEST_F(PacketTest, AnyLegalRecordIsWrittenWithTheSameBytes) {
  std::mt19937 random(20260101);
  for (int repetition = 0; repetition < 50; ++repetition) {
    for (const int number : {0, 1, 2, 3, 4, 5, 7, 8}) {
      const auto type = static_cast<std::uint8_t>(number);
      SCOPED_TRACE(number);
      const std::uint8_t device = type < 2 ? kMid40 : kAvia;
      expect_same_bytes(one_package_file(device, type, records(type, random)));
    }
  }
}

TEST_F(PacketTest, ExtremeRecordsAreWrittenWithTheSameBytes) {
  std::string cartesian, spherical;
  constexpr std::int32_t kMin = std::numeric_limits<std::int32_t>::min(),
                         kMax = std::numeric_limits<std::int32_t>::max();
  const std::int32_t values[] = {kMin, kMax, -1, 0, 1};
  std::size_t count = 0;
  for (const std::int32_t x : values) {
    for (const std::int32_t y : values) {
      for (const std::int32_t z : {kMin, 0, 1, kMax}) {
        if (count++ == 100) break;
        for (const std::int32_t v : {x, y, z}) put(cartesian, v);
        put(cartesian, std::uint8_t{77});
      }
    }
  }
  expect_same_bytes(one_package_file(kMid40, 0, cartesian));
  const std::uint16_t kAzimuths[] = {0, 1, 9000, 17999, 18000, 18001, 27000, 35999};
  for (const std::uint32_t depth : {1U, 4294967295U}) {
    for (const std::uint16_t zenith : std::vector<std::uint16_t>{0, 1, 9000, 17999, 18000}) {
      for (const std::uint16_t azimuth : kAzimuths) {
        spherical += spherical_record(1, zenith, azimuth, {depth}, 1, 0);
      }
    }
  }
  // Angles of null returns are not judged.
  spherical += spherical_record(1, 65535, 65535, {0}, 1, 0);
  spherical += spherical_record(1, 18001, 36001, {0}, 1, 0);
  expect_same_bytes(one_package_file(kMid40, 1, spherical));
}

TEST_F(PacketTest, AFullTurnIsWrittenAsZero) {
  const auto file = [](std::uint16_t azimuth) {
    return one_package_file(kMid40, 1,
                            spherical_record(1, 9000, azimuth, {4000}, 1, 0) +
                                spherical_record(1, 9000, azimuth, {0}, 1, 0));
  };
  const Recording recording = load(file(36000));
  EXPECT_EQ(recording.data.observations.azimuth[0], 0.0);
  EXPECT_TRUE(write(recording) == file(0));
}

TEST_F(PacketTest, AnglesThatNoSensorSendsAreDamage) {
  for (const auto& [zenith, azimuth] : {std::pair{18001, 0}, std::pair{0, 36001}}) {
    std::string body = spherical_record(1, 9000, 0, {4000}, 1, 0);
    body += spherical_record(1, static_cast<std::uint16_t>(zenith),
                             static_cast<std::uint16_t>(azimuth), {1}, 1, 0);
    try {
      load(one_package_file(kMid40, 1, body));
      FAIL() << "an impossible angle was accepted";
    } catch (const FileError& error) {
      EXPECT_EQ(error.place().byte_offset, 88U + 24 + 19 + 9);
      EXPECT_THAT(error.what(), NamesField("18000"));
    }
  }
}

TEST_F(PacketTest, ImuSamplesKeepTheirBits) {
  std::string body;
  for (const float v : {0.25F, -1.5F, 3.0F, 0.01F, -0.02F, 1.003F}) put(body, v);
  const Recording recording = load(one_package_file(kAvia, 6, body, 1, 123'456'789));
  ASSERT_EQ(recording.data.imu.size(), 1U);
  const ImuSample& sample = recording.data.imu[0];
  EXPECT_EQ(sample.time_ns, 123'456'789);
  EXPECT_THAT(sample.angular_velocity, ::testing::ElementsAre(0.25F, -1.5F, 3.0F));
  EXPECT_THAT(sample.acceleration_g, ::testing::ElementsAre(0.01F, -0.02F, 1.003F));
}

// --- times ---------------------------------------------------------------------------------------

std::uint64_t gps_bytes(unsigned year, unsigned month, unsigned day, unsigned hour,
                        std::uint32_t us) {
  return std::uint64_t{year - 2000} | std::uint64_t{month} << 8U | std::uint64_t{day} << 16U |
         std::uint64_t{hour} << 24U | std::uint64_t{us} << 32U;
}

/// Start times of packets with these raw timestamps.
class ClockTest : public PacketTest {
 protected:
  std::vector<std::int64_t> times(std::uint8_t type, const std::vector<std::uint64_t>& raw) {
    std::mt19937 random(3);
    std::string file = header_lvx11({{"A", 0, kMid40}});
    std::vector<std::string> packages;
    for (const std::uint64_t value : raw) packages.push_back(package(0, type, 1, value, random));
    put_frame(file, packages, 0);
    format_tests::put_bytes(folder_.file("clock.lvx"), file);
    const auto reader = open_recording(folder_.file("clock.lvx"));
    reference_ = reader->header().time_reference;
    Chunk chunk;
    std::vector<std::int64_t> result;
    while (reader->read(chunk, 100)) result.push_back(chunk.observations.time_ns[0]);
    wraps_ = reader->clock_wraps();
    expect_same_bytes(file);
    return result;
  }

  TimeReference reference_{};
  std::uint64_t wraps_ = 0;
};

TEST_F(ClockTest, CountersArePassedAsTheyAre) {
  for (const int type : {0, 1, 2, 5}) {
    EXPECT_THAT(times(static_cast<std::uint8_t>(type), {7, 1'000'007, 1'234'567'890'123'456'789}),
                ::testing::ElementsAre(7, 1'000'007, 1'234'567'890'123'456'789));
    EXPECT_EQ(reference_, type == 1 ? TimeReference::ptp : TimeReference::power_on);
  }
}

TEST_F(ClockTest, GpsTimesAreUtcAndRollOverTheHour) {
  // 15 08 1A 07 60 E3 16 00 is 2021-08-26 07:00:01.5
  std::uint64_t example = 0;
  std::memcpy(&example, "\x15\x08\x1A\x07\x60\xE3\x16\x00", 8);
  EXPECT_THAT(times(3, {example}), ::testing::ElementsAre(1'629'961'201'500'000'000));
  EXPECT_EQ(reference_, TimeReference::utc);
  EXPECT_THAT(times(3, {gps_bytes(2023, 12, 31, 23, 3'599'999'000), gps_bytes(2024, 1, 1, 0, 0)}),
              ::testing::ElementsAre(1'704'067'199'999'000'000, 1'704'067'200'000'000'000));
  EXPECT_THAT(
      times(3, {gps_bytes(2024, 2, 28, 23, 3'599'999'999), gps_bytes(2024, 2, 29, 0, 1000)}),
      ::testing::ElementsAre(1'709'164'799'999'999'000, 1'709'164'800'001'000'000));
}

TEST_F(ClockTest, BytesThatAreNoTimeAreDamage) {
  const std::pair<int, std::uint64_t> cases[] = {
      {3, gps_bytes(2021, 0, 1, 0, 0)},
      {3, gps_bytes(2021, 13, 1, 0, 0)},
      {3, gps_bytes(2021, 1, 0, 0, 0)},
      {3, gps_bytes(2021, 2, 29, 0, 0)},
      {3, gps_bytes(2021, 1, 1, 24, 0)},
      {0, ~std::uint64_t{0}},
      {4, ~std::uint64_t{0}},
      {6, 0},
  };
  for (const auto& [type, raw] : cases) {
    try {
      times(static_cast<std::uint8_t>(type), {raw});
      FAIL() << type << " " << raw;
    } catch (const FileError& error) {
      EXPECT_EQ(error.place().byte_offset, 88U + 24 + 9);
    }
  }
}

TEST_F(ClockTest, PpsTimesGainASecondAtEveryEdge) {
  EXPECT_THAT(times(4, {998'000'000, 999'000'000, 0, 1'000'000, 999'500'000, 500'000}),
              ::testing::ElementsAre(998'000'000, 999'000'000, 1'000'000'000, 1'001'000'000,
                                     1'999'500'000, 2'000'500'000));
  EXPECT_EQ(wraps_, 2U);
  EXPECT_EQ(reference_, TimeReference::pps);
}

TEST_F(ClockTest, PpsEdgesAreSeenWhenPacketsAroundThemAreLost) {
  EXPECT_THAT(times(4, {999'000'000, 5'000'000}),
              ::testing::ElementsAre(999'000'000, 1'005'000'000));
  EXPECT_THAT(times(4, {700'000'000, 400'000'000}),
              ::testing::ElementsAre(700'000'000, 1'400'000'000));
  EXPECT_EQ(wraps_, 1U);
}

TEST_F(ClockTest, PpsPacketsThatOvertakeEachOtherMakeNoSecond) {
  EXPECT_THAT(times(4, {500'000'000, 502'000'000, 501'000'000, 503'000'000}),
              ::testing::ElementsAre(500'000'000, 502'000'000, 501'000'000, 503'000'000));
  EXPECT_EQ(wraps_, 0U);
  EXPECT_THAT(times(4, {998'000'000, 0, 999'000'000, 1'000'000}),
              ::testing::ElementsAre(998'000'000, 1'000'000'000, 999'000'000, 1'001'000'000));
  EXPECT_EQ(wraps_, 1U);
}

TEST_F(ClockTest, PpsTimesGoOnWithoutEdges) {
  EXPECT_THAT(times(4, {999'000'000, 1'800'000'000, 2'300'000'000, 100'000}),
              ::testing::ElementsAre(999'000'000, 1'800'000'000, 2'300'000'000, 3'000'100'000));
  // A sensor second that is slightly longer than the master's adds one second, not two.
  EXPECT_THAT(times(4, {1'000'050'000, 40'000}),
              ::testing::ElementsAre(1'000'050'000, 1'000'040'000));
}

// --- values that a record cannot hold ------------------------------------------------------------

struct RefusedCase {
  const char* name;
  std::uint8_t data_type;
  std::function<void(Observations&)> change;
  std::vector<std::string> message;
};

TEST_F(PacketTest, ValuesThatDoNotFitAreRefusedWithRowAndRange) {
  constexpr std::size_t kRow = 17;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<RefusedCase> cases = {
      {"far", 1, [](auto& o) { o.range[kRow] = 4294967.3; }, {"range", "4294967.3", "4294967.295"}},
      {"negative", 1, [](auto& o) { o.range[kRow] = -1; }, {"range", "-1", "4294967.295"}},
      {"infinite",
       1,
       [](auto& o) { o.range[kRow] = std::numeric_limits<double>::infinity(); },
       {"range", "inf"}},
      {"missing", 1, [nan](auto& o) { o.range[kRow] = nan; }, {"range"}},
      {"tiny", 1, [](auto& o) { o.range[kRow] = 0.0004; }, {"range", "0.0004", "0.0005"}},
      {"zenith", 1, [](auto& o) { o.zenith[kRow] = 3.2; }, {"zenith", "183.3", "180"}},
      {"zenith below", 1, [](auto& o) { o.zenith[kRow] = -0.1; }, {"zenith", "-5.7", "180"}},
      {"azimuth", 1, [](auto& o) { o.azimuth[kRow] = 4.0; }, {"azimuth", "229.1", "180"}},
      {"azimuth nan", 1, [nan](auto& o) { o.azimuth[kRow] = nan; }, {"azimuth", "nan"}},
      {"tag", 1, [](auto& o) { o.tag[kRow] = 16; }, {"tag", "16"}},
      {"tag", 0, [](auto& o) { o.tag[kRow] = 16; }, {"tag", "16"}},
      {"far point",
       0,
       [](auto& o) {
         o.range[kRow] = 4e6;
         o.azimuth[kRow] = 0.0;
         o.zenith[kRow] = kPi / 2;
       },
       {"range", "2147483.647"}},
      {"tiny point", 0, [](auto& o) { o.range[kRow] = 0.0004; }, {"range", "0.0004"}},
      {"missing", 0, [nan](auto& o) { o.range[kRow] = nan; }, {"range"}},
      {"two directions", 5, [](auto& o) { o.zenith[kRow] += 0.02; }, {"zenith", "shot"}},
  };
  std::mt19937 random(5);
  for (const RefusedCase& c : cases) {
    SCOPED_TRACE(c.name);
    Recording recording = load(one_package_file(c.data_type < 2 ? kMid40 : kAvia, c.data_type,
                                                records(c.data_type, random)));
    Observations& o = recording.data.observations;
    for (const std::size_t row : {kRow - 1, kRow}) {
      o.valid[row] = 1;
      o.range[row] = 3.0;
      o.azimuth[row] = 1.0;
      o.zenith[row] = 1.5;
    }
    ASSERT_NO_THROW(write(recording));
    c.change(o);
    try {
      write(recording);
      ADD_FAILURE() << "was written";
    } catch (const InvalidArgument& error) {
      EXPECT_THAT(error.what(), NamesField("row 17"));
      for (const std::string& part : c.message) {
        EXPECT_THAT(error.what(), ::testing::HasSubstr(part));
      }
    }
    EXPECT_FALSE(std::filesystem::exists(folder_.file("out.lvx")));
  }
}

}  // namespace risley::recordings::packet_test
