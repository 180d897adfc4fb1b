// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/time_audit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/recordings/reader.hpp"

#include "recordings/format_tests.hpp"
#include "recordings/lvx_bytes.hpp"

namespace risley::recordings::time_audit_test {

constexpr std::int64_t kStep = 10'000;

/// Rows at these times, one return each.
Chunk rows_at(const std::vector<std::int64_t>& times, std::uint8_t device = 0) {
  Chunk chunk;
  Observations& o = chunk.observations;
  o.resize(times.size());
  o.time_ns = times;
  for (std::size_t row = 0; row < times.size(); ++row) {
    o.range[row] = 5.0;
    o.valid[row] = 1;
    o.return_number[row] = 1;
    o.device[row] = device;
  }
  return chunk;
}

std::vector<std::int64_t> steps(std::size_t count, std::int64_t step = kStep,
                                std::int64_t start = 0) {
  std::vector<std::int64_t> times;
  for (std::size_t i = 0; i < count; ++i) {
    times.push_back(start + static_cast<std::int64_t>(i) * step);
  }
  return times;
}

TimeAuditResult audit(const Chunk& chunk) {
  TimeAudit audit;
  audit.add(chunk);
  return audit.result();
}

TEST(TimeAudit, AnEmptyRecordingHasNoTimes) {
  const TimeAuditResult result = TimeAudit().result();
  EXPECT_EQ(result.observations, 0U);
  EXPECT_EQ(result.duration_s, 0.0);
  EXPECT_EQ(result.rate_hz, 0.0);
  EXPECT_FALSE(result.azimuth || result.zenith || result.range);
  EXPECT_EQ(audit(rows_at({5})).shots, 1U);
  EXPECT_EQ(audit(rows_at({5, 5, 5})).rate_hz, 0.0);
}

TEST(TimeAudit, ARegularRecordingHasNoFaults) {
  const TimeAuditResult result = audit(rows_at(steps(100'000, kStep, 777)));
  EXPECT_EQ(result.observations, 100'000U);
  EXPECT_EQ(result.shots, 100'000U);
  EXPECT_EQ(result.first_time_ns, 777);
  EXPECT_EQ(result.last_time_ns, 777 + 99'999 * kStep);
  EXPECT_DOUBLE_EQ(result.duration_s, 0.99999);
  EXPECT_DOUBLE_EQ(result.rate_hz, 1e5);
  EXPECT_DOUBLE_EQ(result.nominal_step_s, 1e-5);
  EXPECT_EQ(result.gaps.count, 0U);
  EXPECT_EQ(result.time_resets, 0U);
}

TEST(TimeAudit, RoundedStepsOf240KilohertzGiveTheExactRate) {
  std::vector<std::int64_t> times;
  for (int i = 0; i < 48'001; ++i) times.push_back(std::llround(i * 1e9 / 240'000.0));
  const TimeAuditResult result = audit(rows_at(times));
  EXPECT_NEAR(result.rate_hz, 240'000.0, 1e-6);
  EXPECT_EQ(result.gaps.count, 0U);
}

TEST(TimeAudit, GapsAreCountedAndDoNotChangeTheRate) {
  for (const std::size_t before : {100U, 10'000U}) {  // within and after the first median
    std::vector<std::int64_t> times = steps(before);
    const std::int64_t first_gap = times.back();
    for (const std::int64_t t : steps(5000, kStep, first_gap + 3 * kStep)) times.push_back(t);
    const std::int64_t second_gap = times.back();
    for (const std::int64_t t : steps(5000, kStep, second_gap + 1'000'000'000)) times.push_back(t);
    times.push_back(times.back() + 17 * kStep / 10);  // 1.7 steps are no gap
    const TimeAuditResult result = audit(rows_at(times));
    EXPECT_EQ(result.gaps.count, 2U);
    EXPECT_NEAR(result.gaps.total_s, 2e-5 + 1.0 - 1e-5, 1e-12);
    EXPECT_NEAR(result.gaps.largest_s, 1.0 - 1e-5, 1e-12);
    EXPECT_EQ(result.gaps.largest_after_ns, second_gap);
    EXPECT_EQ(result.gaps.largest_at_row, before + 5000);
    EXPECT_NEAR(result.rate_hz, 1e5, 10.0);
    EXPECT_EQ(result.time_resets, 0U);
    EXPECT_NEAR(result.duration_s, static_cast<double>(times.back()) * 1e-9, 1e-12);
  }
}

TEST(TimeAudit, ChunksOfAnySizeGiveTheSameResult) {
  std::vector<std::int64_t> times = steps(9000);
  for (const std::int64_t t : steps(9000, kStep, 200'000'000)) times.push_back(t);
  for (const std::int64_t t : steps(100, kStep, 50)) times.push_back(t);
  const TimeAuditResult whole = audit(rows_at(times));
  TimeAudit pieces;
  for (std::size_t at = 0; at < times.size(); at += 37) {
    const std::size_t end = std::min(at + 37, times.size());
    pieces.add(rows_at({times.begin() + static_cast<std::ptrdiff_t>(at),
                        times.begin() + static_cast<std::ptrdiff_t>(end)}));
    if (at % 370 == 0) pieces.result();  // looking does not disturb
  }
  const TimeAuditResult result = pieces.result();
  EXPECT_EQ(result.gaps.count, whole.gaps.count);
  EXPECT_EQ(whole.gaps.count, 1U);
  EXPECT_EQ(result.gaps.total_s, whole.gaps.total_s);
  EXPECT_EQ(result.gaps.largest_at_row, whole.gaps.largest_at_row);
  EXPECT_EQ(result.time_resets, whole.time_resets);
  EXPECT_EQ(whole.time_resets, 1U);
  EXPECT_EQ(result.rate_hz, whole.rate_hz);
  EXPECT_EQ(result.duration_s, whole.duration_s);
}

TEST(TimeAudit, BackwardJumpsAreResetsAndNotPartOfTheDuration) {
  std::vector<std::int64_t> times = steps(1001, kStep, 5'000'000'000);
  for (const std::int64_t t : steps(1001)) times.push_back(t);
  const TimeAuditResult result = audit(rows_at(times));
  EXPECT_EQ(result.time_resets, 1U);
  EXPECT_EQ(result.gaps.count, 0U);
  EXPECT_NEAR(result.duration_s, 0.02, 1e-12);
}

TEST(TimeAudit, ReturnsOfOneShotAreOneShot) {
  Chunk chunk = rows_at({0, 0, 0, kStep, kStep, kStep, 2 * kStep, 2 * kStep});
  chunk.observations.return_number = {1, 2, 3, 1, 2, 3, 1, 2};
  chunk.observations.valid[1] = 0;
  chunk.observations.valid[2] = 0;
  const TimeAuditResult result = audit(chunk);
  EXPECT_EQ(result.observations, 8U);
  EXPECT_EQ(result.shots, 3U);
  EXPECT_EQ(result.no_return, 2U);
  EXPECT_DOUBLE_EQ(result.rate_hz, 1e5);
  EXPECT_EQ(result.rows_by_return_number[1], 3U);
  EXPECT_EQ(result.rows_by_return_number[2], 3U);
  EXPECT_EQ(result.rows_by_return_number[3], 2U);
}

TEST(TimeAudit, ExtremesAreThoseOfValidRows) {
  Chunk chunk = rows_at(steps(4));
  Observations& o = chunk.observations;
  o.azimuth = {-0.3, 9.0, 0.2, 0.1};
  o.zenith = {1.4, -9.0, 1.6, 1.5};
  o.range = {3.0, 0.0, 7.5, std::numeric_limits<double>::quiet_NaN()};
  o.valid[1] = 0;
  const TimeAuditResult result = audit(chunk);
  EXPECT_EQ(result.azimuth->min, -0.3);
  EXPECT_EQ(result.azimuth->max, 0.2);
  EXPECT_EQ(result.zenith->min, 1.4);
  EXPECT_EQ(result.zenith->max, 1.6);
  EXPECT_EQ(result.range->min, 3.0);
  EXPECT_EQ(result.range->max, 7.5);
}

TEST(TimeAudit, DevicesAreComparedWithThemselves) {
  Chunk chunk;
  for (std::int64_t i = 0; i < 1000; ++i) {
    chunk.observations.append(rows_at({i * kStep}, 0).observations);
    chunk.observations.append(rows_at({i * kStep + 900'000'000}, 2).observations);
  }
  const TimeAuditResult result = audit(chunk);
  EXPECT_EQ(result.time_resets, 0U);
  EXPECT_EQ(result.gaps.count, 0U);
  EXPECT_DOUBLE_EQ(result.rate_hz, 1e5);
  EXPECT_THAT(result.rows_by_device, ::testing::ElementsAre(1000, 0, 1000));
}

// --- packets -------------------------------------------------------------------------------------

struct TestPacket {
  std::int64_t time_ns;
  std::uint8_t timestamp_type = 0;
};

Chunk packets_at(const std::vector<TestPacket>& list) {
  Chunk chunk;
  for (const TestPacket& one : list) {
    Packet packet;
    packet.rows = 100;
    packet.timestamp_type = one.timestamp_type;
    chunk.packets.push_back(packet);
    chunk.observations.append(rows_at(steps(100, kStep, one.time_ns)).observations);
  }
  return chunk;
}

constexpr std::int64_t kMs = 1'000'000;

TEST(TimeAudit, RepeatedAndLatePacketsAreNoResets) {
  TimeAuditResult result = audit(packets_at({{0}, {kMs}, {kMs}, {2 * kMs}}));
  EXPECT_EQ(result.non_monotonic_packets, 1U);
  EXPECT_EQ(result.time_resets, 0U);
  EXPECT_EQ(result.gaps.count, 0U);
  EXPECT_EQ(result.packets_by_data_type[1], 4U);
  result = audit(packets_at({{0}, {2 * kMs}, {kMs}, {3 * kMs}}));
  EXPECT_EQ(result.non_monotonic_packets, 1U);
  EXPECT_EQ(result.time_resets, 0U);
  EXPECT_DOUBLE_EQ(result.duration_s, 0.00399);
  result = audit(packets_at({{500 * kMs}, {501 * kMs}, {0}, {kMs}}));
  EXPECT_EQ(result.non_monotonic_packets, 1U);
  EXPECT_EQ(result.time_resets, 1U);
}

TEST(TimeAudit, AJumpWithTheSourceOfTimeIsAResetAndNoGap) {
  const std::int64_t utc = 1'700'000'000 * std::int64_t{1'000'000'000};
  TimeAuditResult result = audit(packets_at({{0}, {kMs}, {utc, 3}, {utc + kMs, 3}}));
  EXPECT_EQ(result.time_resets, 1U);
  EXPECT_EQ(result.gaps.count, 0U);
  EXPECT_NEAR(result.duration_s, 0.00398, 1e-12);
  result = audit(packets_at({{utc, 3}, {utc + kMs, 3}, {2 * kMs}, {3 * kMs}}));
  EXPECT_EQ(result.time_resets, 1U);
  result = audit(packets_at({{0}, {kMs}, {2 * kMs, 1}, {3 * kMs, 1}}));  // without a jump
  EXPECT_EQ(result.time_resets, 0U);
  result = audit(packets_at({{0}, {kMs}, {utc}, {utc + kMs}}));  // the same source: a long gap
  EXPECT_EQ(result.time_resets, 0U);
  EXPECT_EQ(result.gaps.count, 1U);
}

TEST(TimeAudit, PacketsOfEveryDataTypeAreCounted) {
  Chunk chunk = packets_at({{0}, {kMs}, {2 * kMs}});
  chunk.packets[0].data_type = 0;
  chunk.packets[1].data_type = 17;  // the last one that there is
  chunk.packets[2].data_type = 18;
  const TimeAuditResult result = audit(chunk);
  EXPECT_EQ(result.packets_by_data_type.front(), 1U);
  EXPECT_EQ(result.packets_by_data_type.back(), 1U);
}

TEST(TimeAudit, AFileIsAuditedWithItsWrapsAndSamples) {
  const lvx_bytes::TestFolder folder;
  std::mt19937 random(1);
  std::string file = lvx_bytes::header_lvx11({{"A", 0, 7}});
  lvx_bytes::put_frame(
      file,
      {lvx_bytes::package(0, 4, 5, 999'600'000, random),
       lvx_bytes::package(0, 4, 6, 999'700'000, random),
       lvx_bytes::package(0, 4, 5, 999'800'000, random), lvx_bytes::package(0, 4, 5, 0, random)},
      0);
  format_tests::put_bytes(folder.file("a.lvx"), file);
  const auto reader = open_recording(folder.file("a.lvx"));
  double last = 0;
  const TimeAuditResult result = audit_recording(*reader, [&](double f) { last = f; });
  EXPECT_EQ(last, 1.0);
  EXPECT_EQ(result.pps_wraps, 1U);
  EXPECT_EQ(result.imu, 1U);
  EXPECT_EQ(result.packets_by_data_type[5], 3U);
  EXPECT_EQ(result.packets_by_data_type[6], 1U);
  EXPECT_EQ(result.shots, 144U);
  EXPECT_EQ(result.gaps.count, 0U);
  EXPECT_NEAR(result.rate_hz, 240'000, 1);
}

TEST(TimeAudit, TimesOfAnySizeDoNotOverflow) {
  constexpr std::int64_t kLatest = std::numeric_limits<std::int64_t>::max(),
                         kEarliest = std::numeric_limits<std::int64_t>::min();
  const TimeAuditResult result =
      audit(rows_at({kEarliest, kLatest, kEarliest + 1, kLatest - 1, kEarliest, kLatest}));
  EXPECT_EQ(result.time_resets, 2U);
  EXPECT_NEAR(result.duration_s, 9.22e9, 1e7);
  TimeAudit audit;
  for (const std::int64_t time : {kLatest, kEarliest}) {
    Chunk chunk = rows_at({time});
    chunk.packets.emplace_back().rows = 1;
    audit.add(chunk);
  }
  EXPECT_EQ(audit.result().non_monotonic_packets, 1U);
}

TEST(TimeAudit, TimesTooFarApartAreDamage) {
  const lvx_bytes::TestFolder folder;
  const std::string path = folder.file("far.csv");
  format_tests::put_bytes(
      path,
      "Time/s,Azimuth/deg,Zenith/deg\n-9100000000.0,1.0,90.0\n-9099999999.0,1.0,90.0\n"
      "9100000000.0,1.1,90.0\n9100000001.0,1.1,90.0\n");
  const auto reader = open_recording(path);
  Chunk chunk;
  ASSERT_TRUE(reader->read(chunk));
  EXPECT_EQ(chunk.observations.size(), 2U);
  for (int i = 0; i < 2; ++i) {
    try {
      reader->read(chunk);
      FAIL() << "a time further away than 146 years was accepted";
    } catch (const FileError& error) {
      EXPECT_EQ(error.path(), path);
      EXPECT_THAT(error.problem(), ::testing::HasSubstr("observation 2 (from 0)"));
      EXPECT_THAT(error.problem(), ::testing::HasSubstr("within 146 years"));
    }
  }
}

TEST(TimeAudit, PacketsStayWholeInFrontOfATimeTooFarAway) {
  const lvx_bytes::TestFolder folder;
  const std::string path = folder.file("far.lvx");
  std::mt19937 random(1);
  std::string file = lvx_bytes::header_lvx11({{"0TFDG3B006H2Z11", 0, 7}});
  constexpr std::uint64_t kFar = std::uint64_t{1} << 62;
  lvx_bytes::put_frame(
      file,
      {lvx_bytes::package(0, 1, 3, 1000, random), lvx_bytes::package(0, 1, 6, 2000, random),
       lvx_bytes::package(0, 1, 3, kFar, random)},
      0);
  format_tests::put_bytes(path, file);
  const auto reader = open_recording(path);
  Chunk chunk;
  ASSERT_TRUE(reader->read(chunk));
  // The far packet begins within the span and ends behind it.
  EXPECT_EQ(chunk.observations.size(), 96U);
  EXPECT_EQ(chunk.packets.size(), 2U);
  EXPECT_EQ(chunk.imu.size(), 1U);
  EXPECT_THROW(reader->read(chunk), FileError);
}

}  // namespace risley::recordings::time_audit_test
