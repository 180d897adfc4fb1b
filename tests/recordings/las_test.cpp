// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/vector3.hpp"

#include "recordings/format_tests.hpp"
#include "recordings/las_bytes.hpp"

namespace risley::recordings::las_test {

using namespace format_tests;
using las_bytes::descriptor;
using las_bytes::LasFile;
using las_bytes::LasPoint;
using las_bytes::put;
using ::testing::_;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Points about a sensor, in odd millimetres, one every 10 us.
std::vector<LasPoint> some_points(std::size_t count, double first_time = 100.0) {
  std::vector<LasPoint> points(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto k = static_cast<std::int32_t>(i);
    points[i].xyz = {5001 + 10 * k, (k % 41 - 20) * 37, 1 - (k % 31) * 29};
    points[i].gps_time = first_time + 1e-5 * static_cast<double>(i);
    points[i].intensity = static_cast<std::uint16_t>(i % 256);
  }
  return points;
}

LasFile some_file(std::size_t count = 40, int minor = 2, int format = 1) {
  LasFile file;
  file.minor = minor;
  file.format = format;
  file.points = some_points(count);
  return file;
}

Outcome read_las(const std::string& bytes, std::size_t chunk_rows = kDefaultChunkRows) {
  return read_text(kLasFormat, bytes, chunk_rows);
}

Vector3<double> position(const Observations& rows, std::size_t row) {
  const double horizontal = rows.range[row] * std::sin(rows.zenith[row]);
  return {horizontal * std::cos(rows.azimuth[row]), horizontal * std::sin(rows.azimuth[row]),
          rows.range[row] * std::cos(rows.zenith[row])};
}

void expect_positions(const Observations& rows, const LasFile& file) {
  ASSERT_EQ(rows.size(), file.points.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Vector3<double> found = position(rows, i);
    const auto expected = [&](std::size_t axis) {
      return file.points[i].xyz[axis] * file.scale[axis] + file.offset[axis];
    };
    ASSERT_NEAR(found.x, expected(0), 1e-9) << i;
    ASSERT_NEAR(found.y, expected(1), 1e-9) << i;
    ASSERT_NEAR(found.z, expected(2), 1e-9) << i;
  }
}

/// A file that is refused: where, and what is named.
void expect_refused(const std::string& bytes, std::uint64_t byte, const std::string& named) {
  const Outcome outcome = read_las(bytes);
  EXPECT_FALSE(outcome.opened) << named;
  expect_damage(outcome, NamesField(named), 0, byte);
}

class PointFormatTest : public ::testing::TestWithParam<int> {};

TEST_P(PointFormatTest, GivesEveryField) {
  const int format = GetParam();
  LasFile file = some_file(60, format >= 6 ? 4 : format >= 4 ? 3 : 2, format);
  const bool has_times = format != 0 && format != 2;
  file.extra_bytes = 7;
  file.records = {{"somebody", 4, std::string(100, 'x')},
                  {"LASF_Spec", 4,
                   descriptor("Other", 9) + descriptor("Undocumented", 0, 1) +
                       descriptor("Tag", 1) + descriptor("Beam", 1)}};
  file.gap = 2;  // the signature that LAS 1.0 has there
  for (std::size_t i = 0; i < file.points.size(); ++i) {
    LasPoint& point = file.points[i];
    point.extra = {1, 2, 3, 4, 5, static_cast<char>(i), static_cast<char>(i % 6)};
    point.returns = 2;
    point.return_number = static_cast<unsigned>(1 + i % 2);
    if (i % 2 == 1) point.gps_time = file.points[i - 1].gps_time;
  }
  const Outcome outcome = read_las(file.bytes(), 7);
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  const RecordingHeader& header = outcome.recording.header;
  EXPECT_EQ(header.format, "las");
  EXPECT_TRUE(header.cartesian);
  EXPECT_TRUE(header.has_range);
  EXPECT_TRUE(header.has_intensity);
  EXPECT_EQ(header.has_times, has_times);
  EXPECT_EQ(header.time_reference, TimeReference::relative);
  EXPECT_EQ(header.returns_per_shot, 2);
  ASSERT_EQ(header.devices.size(), 1U);
  EXPECT_EQ(header.devices[0].type, kUnknownDeviceType);
  const Observations& rows = outcome.rows();
  expect_positions(rows, file);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto shot = static_cast<std::int64_t>(i / 2);
    EXPECT_EQ(rows.time_ns[i], has_times ? 100'000'000'000 + 20'000 * shot : shot) << i;
    EXPECT_EQ(rows.return_number[i], 1 + i % 2);
    EXPECT_EQ(rows.intensity[i], i);
    EXPECT_EQ(rows.tag[i], i);
    EXPECT_EQ(rows.beam[i], i % 6);
    EXPECT_EQ(rows.device[i], 0);
    EXPECT_EQ(rows.valid[i], 1);
    EXPECT_FLOAT_EQ(rows.range_resolution[i], 1e-3F);
    EXPECT_FLOAT_EQ(rows.zenith_resolution[i], static_cast<float>(1e-3 / rows.range[i]));
  }
  if (has_times) {
    EXPECT_THAT(warnings_of(outcome), IsEmpty());
  } else {
    EXPECT_THAT(warnings_of(outcome), Contains(Warns(kWarning.no_shot_times)));
  }
}

INSTANTIATE_TEST_SUITE_P(All, PointFormatTest, ::testing::Range(0, 11));

TEST(LasTest, TakesTheScannerChannelAsBeam) {
  LasFile file = some_file(8, 4, 6);
  for (std::size_t i = 0; i < 8; ++i) file.points[i].channel = static_cast<unsigned>(i % 4);
  const Outcome outcome = read_las(file.bytes());
  ASSERT_FALSE(outcome.error);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(outcome.rows().beam[i], i % 4);
}

TEST(LasTest, ReadsEveryVersionAndLongerHeaders) {
  for (int minor = 0; minor <= 4; ++minor) {
    SCOPED_TRACE(minor);
    LasFile file = some_file(20, minor, 1);
    file.longer_header = 13;
    const Outcome outcome = read_las(file.bytes());
    ASSERT_FALSE(outcome.error) << outcome.error->what();
    EXPECT_THAT(warnings_of(outcome), IsEmpty());
    expect_positions(outcome.rows(), file);
  }
}

TEST(LasTest, IsRecognisedByItsContent) {
  const TestFolder folder;
  put_bytes(folder.file("cloud.dat"), some_file().bytes());
  EXPECT_EQ(open_recording(folder.file("cloud.dat"))->header().format, "las");
}

TEST(LasTest, PiecesOfAnyLengthAreTheSame) {
  const std::string bytes = some_file(20'000).bytes();
  const Outcome whole = read_las(bytes);
  EXPECT_EQ(whole.rows().size(), 20'000U);
  for (const std::size_t rows : {std::size_t{1000}, std::size_t{8192}, std::size_t{12'345}}) {
    EXPECT_TRUE(is_same(read_las(bytes, rows).rows(), whole.rows())) << rows;
  }
}

TEST(LasTest, AnEmptyCloudHasNoRows) {
  const Outcome outcome = read_las(some_file(0).bytes());
  EXPECT_FALSE(outcome.error);
  EXPECT_EQ(outcome.rows().size(), 0U);
}

TEST(LasTest, NullPointsKeepTheirPlaces) {
  LasFile file = some_file(30);
  file.points[3].xyz = file.points[4].xyz = {0, 0, 0};
  for (const double offset : {0.0, 0.7}) {  // 0.7 is no exact multiple of the scale
    SCOPED_TRACE(offset);
    LasFile shifted = file;
    shifted.offset = {offset, offset, offset};
    for (LasPoint& point : shifted.points) {
      for (auto& steps : point.xyz) steps -= static_cast<std::int32_t>(std::lround(offset / 1e-3));
    }
    const Outcome outcome = read_las(shifted.bytes());
    ASSERT_EQ(outcome.rows().size(), 30U);
    for (std::size_t i = 0; i < 30; ++i) {
      const bool null = i == 3 || i == 4;
      EXPECT_EQ(outcome.rows().valid[i], null ? 0 : 1);
      if (!null) continue;
      EXPECT_EQ(outcome.rows().range[i], 0.0);
      EXPECT_TRUE(std::isnan(outcome.rows().azimuth[i]));
    }
  }
}

/// Step that a file's ranges are said to have.
double step_read(const LasFile& file) {
  const Outcome outcome = read_las(file.bytes());
  EXPECT_FALSE(outcome.error);
  return outcome.rows().range_resolution[0];
}

TEST(LasTest, FindsTheStepOfTheCoordinates) {
  LasFile file = some_file(40);
  EXPECT_FLOAT_EQ(static_cast<float>(step_read(file)), 1e-3F);
  file.scale = {1e-4, 1e-4, 1e-4};  // the file keeps tenths of a millimetre
  EXPECT_FLOAT_EQ(static_cast<float>(step_read(file)), 1e-4F);
  for (LasPoint& point : file.points) {
    for (auto& steps : point.xyz) steps *= 10;
  }
  EXPECT_FLOAT_EQ(static_cast<float>(step_read(file)), 1e-3F);  // but was measured in whole ones
  file.scale = {1e-5, 1e-5, 1e-5};
  for (LasPoint& point : file.points) {
    for (auto& steps : point.xyz) steps *= 10;
  }
  EXPECT_FLOAT_EQ(static_cast<float>(step_read(file)), 1e-3F);
  file.points[39].xyz[2] += 1;
  EXPECT_FLOAT_EQ(static_cast<float>(step_read(file)), 1e-3F);  // x and y are still coarse
}

TEST(LasTest, RoundNumbersByChanceAreNoStep) {
  LasFile file = some_file(40);
  for (LasPoint& point : file.points) point.xyz[0] = 20'000;  // a wall straight ahead
  EXPECT_FLOAT_EQ(static_cast<float>(step_read(file)), 1e-3F);
  file.points.resize(5);
  for (LasPoint& point : file.points) point.xyz = {1000, 500, 100};
  EXPECT_FLOAT_EQ(static_cast<float>(step_read(file)), 1e-3F);
}

TEST(LasTest, TakesTheCoarsestAxisAndSaysSo) {
  LasFile file = some_file(40);
  file.scale = {1e-3, 2e-3, 5e-4};
  const Outcome outcome = read_las(file.bytes());
  EXPECT_FLOAT_EQ(outcome.rows().range_resolution[0], 2e-3F);
  EXPECT_THAT(warnings_of(outcome),
              Contains(Warns(kWarning.values_changed, {"0.001, 0.002 and 0.0005 m"})));
  expect_positions(outcome.rows(), file);
}

TEST(LasTest, AdjustedGpsTimeIsUtc) {
  // 2020-01-01 00:00:00 UTC: 1577836800 s since 1970, GPS ahead by 18 s. 2015-06-30: by 16 s.
  struct Case {
    double gps;
    std::int64_t utc_s;
  };
  for (const auto& [gps, utc_s] : {Case{1577836800.0 + 18 - 1315964800.0, 1577836800},
                                   Case{1435622400.0 + 16 - 1315964800.0, 1435622400},
                                   Case{1483228800.0 + 18 - 1315964800.0, 1483228800},
                                   Case{1483228799.0 + 17 - 1315964800.0, 1483228799}}) {
    SCOPED_TRACE(utc_s);
    LasFile file = some_file();
    file.encoding = 1;
    file.points = some_points(40, gps);
    const Outcome outcome = read_las(file.bytes());
    ASSERT_FALSE(outcome.error);
    EXPECT_EQ(outcome.recording.header.time_reference, TimeReference::utc);
    EXPECT_EQ(outcome.rows().time_ns[0], utc_s * 1'000'000'000);
    // A double of such a time has steps of up to 60 ns.
    EXPECT_NEAR(static_cast<double>(outcome.rows().time_ns[7] - outcome.rows().time_ns[0]), 70'000,
                61);
  }
}

TEST(LasTest, TimesThatDoNotFitTheHeaderAreNamedAndKept) {
  struct Case {
    unsigned encoding;
    double first;
    const char* named;
  };
  for (const auto& [encoding, first, named] :
       {Case{1, 400'825.0, "GPS week"}, Case{1, 1.4e9, "GPS time"}, Case{1, 1.7e9, "Unix time"},
        Case{0, 4.0e8, "set bit 0"}, Case{0, 1.4e9, "subtract 1e9"}, Case{0, 1.7e9, "Unix time"}}) {
    SCOPED_TRACE(fmt::format("{} {}", encoding, first));
    LasFile file = some_file();
    file.encoding = static_cast<std::uint16_t>(encoding);
    file.points = some_points(40, first);
    const Outcome outcome = read_las(file.bytes());
    ASSERT_FALSE(outcome.error);
    EXPECT_EQ(outcome.recording.header.time_reference, TimeReference::relative);
    EXPECT_NEAR(1e-9 * static_cast<double>(outcome.rows().time_ns[0]), first, 1e-6);
    EXPECT_THAT(warnings_of(outcome), Contains(Warns(kWarning.clock_unknown, {named})));
  }
  LasFile week = some_file();
  week.points = some_points(40, 400'825.0);
  EXPECT_THAT(warnings_of(read_las(week.bytes())), IsEmpty());
}

TEST(LasTest, TimesOfPacketsAreNoTimesOfShots) {
  for (const std::size_t shared : {std::size_t{100}, std::size_t{1'000'000}}) {
    SCOPED_TRACE(shared);
    LasFile file = some_file(1000);
    for (std::size_t i = 0; i < 1000; ++i) {
      const std::size_t packet = i / shared;
      file.points[i].gps_time = 3.0 + 1e-3 * static_cast<double>(packet);
    }
    const Outcome outcome = read_las(file.bytes());
    EXPECT_FALSE(outcome.recording.header.has_times);
    EXPECT_THAT(warnings_of(outcome), Contains(Warns(kWarning.no_shot_times)));
    for (std::size_t i = 0; i < 1000; ++i) {
      EXPECT_EQ(outcome.rows().time_ns[i], static_cast<std::int64_t>(i));
    }
  }
}

TEST(LasTest, ReturnsOfOneShotShareItsNumber) {
  LasFile file = some_file(90);
  for (std::size_t i = 0; i < 90; ++i) {
    file.points[i].gps_time = 7.0;
    file.points[i].return_number = static_cast<unsigned>(1 + i % 3);
    file.points[i].returns = 3;
  }
  const Outcome outcome = read_las(file.bytes(), 4);
  EXPECT_FALSE(outcome.recording.header.has_times);
  for (std::size_t i = 0; i < 90; ++i) {
    EXPECT_EQ(outcome.rows().time_ns[i], static_cast<std::int64_t>(i / 3));
  }
}

TEST(LasTest, SixBeamsMayFireTogether) {
  LasFile file = some_file(600);
  for (std::size_t i = 0; i < 600; ++i) {
    const std::size_t shot = i / 6;
    file.points[i].gps_time = 1e-3 * static_cast<double>(shot);
  }
  EXPECT_TRUE(read_las(file.bytes()).recording.header.has_times);
}

TEST(LasTest, PointsThatAreNotInTheOrderOfFiringAreSorted) {
  LasFile file = some_file(40);
  const TestFolder folder;
  put_bytes(folder.file("a.las"), file.bytes());
  const Recording sound = load_recording(folder.file("a.las"));
  std::swap(file.points[3], file.points[9]);
  put_bytes(folder.file("a.las"), file.bytes());
  const Recording sorted = load_recording(folder.file("a.las"));
  EXPECT_EQ(sorted.data.observations.time_ns, sound.data.observations.time_ns);
  EXPECT_EQ(sorted.data.observations.azimuth, sound.data.observations.azimuth);
  EXPECT_EQ(sorted.warnings.size(), sound.warnings.size() + 1);
}

TEST(LasTest, ATimeThatIsNoneIsDamageAfterTheRowsBefore) {
  for (const double time : {std::numeric_limits<double>::quiet_NaN(), 1e300}) {
    for (const std::size_t chunk_rows : {std::size_t{4}, std::size_t{1000}}) {
      LasFile file = some_file(40);
      file.points[25].gps_time = time;
      expect_damage(read_las(file.bytes(), chunk_rows), NamesField("point 26"), 25,
                    227U + 25 * 28 + 20);
    }
  }
}

TEST(LasTest, FindsWhatIntensitiesAreMultipliedBy) {
  const auto intensities = [](unsigned factor, unsigned shift) {
    LasFile file = some_file(256);
    for (unsigned i = 0; i < 256; ++i) {
      file.points[i].intensity = static_cast<std::uint16_t>(i * factor + (i < 255 ? shift : 0));
    }
    return read_las(file.bytes()).rows().intensity;
  };
  for (const auto& [factor, shift] :
       {std::pair{1U, 0U}, std::pair{256U, 0U}, std::pair{257U, 0U}, std::pair{256U, 77U}}) {
    SCOPED_TRACE(factor);
    const auto found = intensities(factor, shift);
    for (std::size_t i = 0; i < 256; ++i) EXPECT_EQ(found[i], i);
  }
}

TEST(LasTest, IntensitiesBeyondTheFirstOnesAreClippedAloud) {
  LasFile file = some_file(9000);
  file.points[8999].intensity = 700;
  const Outcome outcome = read_las(file.bytes());
  EXPECT_EQ(outcome.rows().intensity[8999], 255);
  EXPECT_THAT(warnings_of(outcome),
              Contains(Warns(kWarning.values_changed, {"intensity of point 9000", "700"})));
  for (LasPoint& point : file.points) point.intensity = 0;
  EXPECT_FALSE(read_las(file.bytes()).recording.header.has_intensity);
}

TEST(LasTest, CountsAsTheHeaderDoes) {
  LasFile file = some_file(40, 4, 1);
  file.old_count = 39;
  Outcome outcome = read_las(file.bytes());
  EXPECT_EQ(outcome.rows().size(), 40U);
  EXPECT_THAT(warnings_of(outcome),
              Contains(Warns(kWarning.header_contradicted, {"39 points", "40"})));
  file.old_count = 40;
  file.count = 0;  // LAS 1.4 by a program that knows the old counter alone
  outcome = read_las(file.bytes());
  EXPECT_EQ(outcome.rows().size(), 40U);
  EXPECT_THAT(warnings_of(outcome), IsEmpty());
}

TEST(LasTest, PointsThatAreNotCountedAreNotLostSilently) {
  LasFile file = some_file(40);
  file.count = 30;
  Outcome outcome = read_las(file.bytes());
  EXPECT_FALSE(outcome.error);
  EXPECT_EQ(outcome.rows().size(), 30U);
  ASSERT_EQ(outcome.recording.warnings.size(), 1U);
  EXPECT_EQ(outcome.recording.warnings[0].lost_records, 10U);
  EXPECT_EQ(outcome.recording.warnings[0].place.byte_offset, 227U + 30 * 28);
  file.count = 0;  // writing was interrupted before the counter was filled in
  outcome = read_las(file.bytes());
  EXPECT_EQ(outcome.rows().size(), 40U);
  EXPECT_THAT(warnings_of(outcome),
              Contains(Warns(kWarning.header_contradicted, {"0 points", "40"})));
}

TEST(LasTest, ExtendedRecordsAreNoPoints) {
  LasFile file = some_file(40, 4, 6);
  file.extra_bytes = 1;
  for (LasPoint& point : file.points) point.extra = "\x07";
  file.extended = {{"somebody", 1, std::string(300, '\x55')},
                   {"LASF_Spec", 4, descriptor("Beam", 1)}};
  Outcome outcome = read_las(file.bytes());
  ASSERT_FALSE(outcome.error);
  EXPECT_THAT(warnings_of(outcome), IsEmpty());
  EXPECT_EQ(outcome.rows().size(), 40U);
  EXPECT_EQ(outcome.rows().beam[5], 7);  // described behind the points
  file.count = 41;                       // would reach into them
  outcome = read_las(file.bytes());
  expect_damage(outcome, NamesField("records begin"), 40, 375U + 40 * 31);
}

TEST(LasTest, BrokenExtendedRecordsAreAWarning) {
  for (const std::uint64_t length : {std::uint64_t{1000}, ~std::uint64_t{0}}) {
    LasFile file = some_file(40, 4, 6);
    file.extended = {{"somebody", 1, "abc"}};
    std::string bytes = file.bytes();
    put<std::uint64_t>(bytes, 375 + 40 * 30 + 20, length);
    const Outcome outcome = read_las(bytes);
    EXPECT_FALSE(outcome.error);
    EXPECT_EQ(outcome.rows().size(), 40U);
    EXPECT_THAT(warnings_of(outcome),
                Contains(Warns(kWarning.content_left_out, {"extended record 1 of 1"})));
  }
  LasFile file = some_file(40, 4, 6);
  std::string bytes = file.bytes();
  put<std::uint64_t>(bytes, 235, ~std::uint64_t{0} - 3);  // they begin far beyond the file
  put<std::uint32_t>(bytes, 243, 0xffffffff);
  const Outcome outcome = read_las(bytes);
  EXPECT_EQ(outcome.rows().size(), 40U);
  EXPECT_THAT(warnings_of(outcome),
              Contains(Warns(kWarning.content_left_out, {"extended record 1 of 4294967295"})));
}

TEST(LasTest, ExtraBytesBeyondTheRecordAreLeftOut) {
  for (const std::uint8_t type : {std::uint8_t{30}, std::uint8_t{31}, std::uint8_t{255}}) {
    LasFile file = some_file(10);
    file.extra_bytes = 3;
    file.records = {{"LASF_Spec", 4, descriptor("Long", type) + descriptor("Beam", 1)}};
    const Outcome outcome = read_las(file.bytes());
    ASSERT_FALSE(outcome.error);
    EXPECT_EQ(outcome.rows().beam[0], 0);
    EXPECT_THAT(warnings_of(outcome), Contains(Warns(kWarning.columns_unused)));
  }
}

TEST(LasTest, ACutFileGivesItsPointsAndThenTheByte) {
  const LasFile file = some_file(40);
  const std::string bytes = file.bytes();
  const Outcome outcome = read_las(bytes.substr(0, 227 + 17 * 28 + 5), 5);
  EXPECT_TRUE(outcome.opened);
  expect_damage(outcome, NamesField("40 points of 28 bytes"), 17, 227U + 17 * 28);
}

TEST(LasTest, SurvivesACutBehindAnyByte) {
  LasFile file = some_file(6, 4, 7);
  file.records = {{"LASF_Spec", 4, descriptor("Tag", 1)}};
  file.extra_bytes = 2;
  const std::size_t begin = file.points_at(), record = file.record_bytes();
  check_cuts(kLasFormat, file.bytes(), 1, [&](std::string_view head) {
    return std::pair{head.size() < begin ? 0 : (head.size() - begin) / record, true};
  });
}

TEST(LasTest, RefusesHeadersThatMakeNoSense) {
  const std::string sound = some_file(40, 4, 6).bytes();
  const auto with = [&](std::size_t at, auto value) {
    std::string bytes = sound;
    put<decltype(value)>(bytes, at, value);
    return bytes;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_refused(with(24, std::uint8_t{2}), 24, "found LAS 2.4");
  expect_refused(with(25, std::uint8_t{5}), 24, "found LAS 1.5");
  expect_refused(with(94, std::uint16_t{227}), 94, "375 bytes, found 227");
  expect_refused(with(96, std::uint32_t{374}), 96, "found byte 374");
  expect_refused(with(96, std::uint32_t{0xffffffff}), 96, "found byte 4294967295");
  expect_refused(with(104, std::uint8_t{11}), 104, "found 11");
  expect_refused(with(104, std::uint8_t{0x46}), 104, "found 70");
  expect_refused(with(105, std::uint16_t{29}), 105,
                 "at least 30 bytes in point format 6, found 29");
  expect_refused(with(105, std::uint16_t{0}), 105, "found 0");
  for (const double scale :
       {0.0, -1e-3, nan, 1e300, 1e-300, std::numeric_limits<double>::infinity()}) {
    expect_refused(with(139, scale), 139, "scale of y in [1e-09, 1] m");
  }
  for (const double offset : {nan, 1e300, -std::numeric_limits<double>::infinity()}) {
    expect_refused(with(171, offset), 171, "offset of z within +-1e+09 m");
  }
}

TEST(LasTest, RefusesRecordsThatReachIntoThePoints) {
  LasFile file = some_file(40);
  file.records = {{"somebody", 1, std::string(50, 'a')}, {"somebody", 2, ""}};
  const std::string sound = file.bytes();
  std::string bytes = sound;
  put<std::uint32_t>(bytes, 100, 3);
  expect_refused(bytes, 227 + 104 + 54, "variable length record 3 of 3");
  put<std::uint32_t>(bytes, 100, 0xffffffff);
  expect_refused(bytes, 227 + 104 + 54, "variable length record 3 of 4294967295");
  bytes = sound;
  put<std::uint16_t>(bytes, 227 + 20, 0xffff);
  expect_refused(bytes, 227, "variable length record 1 of 2");
  bytes = sound;
  put<std::uint32_t>(bytes, 96, 227 + 104 + 10);  // the points begin within the second
  expect_refused(bytes, 227 + 104, "byte 341");
}

TEST(LasTest, CountsFarBeyondTheFileTakeNoMemory) {
  for (const std::uint64_t count : {std::uint64_t{1} << 40, ~std::uint64_t{0}}) {
    LasFile file = some_file(40, 4, 6);
    file.count = count;
    expect_damage(read_las(file.bytes()), _, 40, 375U + 40 * 30);
  }
}

TEST(LasTest, KnowsTheSensorsOfOurOwnClouds) {
  LasFile file = some_file(3);
  file.system = "Livox Avia 3GGDJ6K00100101";
  file.software = "risley 0.1.0";
  const auto device = [&] { return read_las(file.bytes()).recording.header.devices[0]; };
  EXPECT_EQ(device().type, 7);
  EXPECT_EQ(device().serial, "3GGDJ6K00100101");
  file.software = "another program";
  EXPECT_EQ(device().type, 7);
  EXPECT_EQ(device().serial, "");
  file.system = "Livox Aviator";
  EXPECT_EQ(device().type, kUnknownDeviceType);
}

TEST(LasTest, WithoutLaszipCompressedFilesAreRefusedWithWords) {
#ifdef RISLEY_HAS_LASZIP
  GTEST_SKIP() << "SKIPPED: this build has LASzip";
#else
  const TestFolder folder;
  std::string bytes = some_file().bytes();
  bytes[104] = static_cast<char>(0x81);
  put_bytes(folder.file("cloud.laz"), bytes);
  try {
    open_recording(folder.file("cloud.laz"));
    FAIL() << "was opened";
  } catch (const FileError& error) {
    EXPECT_EQ(error.place().byte_offset, 104U);
    for (const char* word : {"no LASzip", "Debian 12", "liblaszip-dev", "laspy"}) {
      EXPECT_THAT(error.problem(), HasSubstr(word));
    }
  }
#endif
}

}  // namespace risley::recordings::las_test
