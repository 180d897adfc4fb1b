// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Points for messages of ROS 1 and ROS 2 in tests of bags.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "recordings/format_tests.hpp"

namespace risley::recordings::livox_points {

struct Point {
  std::uint32_t offset_ns;
  float x, y, z;
  std::uint8_t intensity = 0, tag = 0, line = 0;
};

inline constexpr std::uint64_t kPowerOn = 5'000'000'000;          // ns since power-on
inline constexpr std::uint64_t kUtc = 1'600'000'000'123'456'789;  // 2020
inline constexpr const char* kTopic = "/livox/lidar";

/// Points of a first message, at kUtc, whose columns all differ.
inline const std::vector<Point> kFirstPoints{{0, 3.0F, 4.0F, 0.0F, 17, 0x10, 2},
                                             {10'000, 0.0F, 0.0F, 0.0F, 9, 0, 3},
                                             {20'000, -1.5F, 0.0F, 2.0F, 255, 0x05, 5}};
inline const std::vector<Point> kNextPoints{{0, 0.0F, 0.0F, 7.0F, 1}};  // 30 us later

inline void expect_those_points(const format_tests::Outcome& outcome, const char* format) {
  using ::testing::ElementsAre;
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  const RecordingHeader& header = outcome.recording.header;
  EXPECT_EQ(header.format, format);
  EXPECT_TRUE(header.cartesian);
  EXPECT_TRUE(header.has_range);
  EXPECT_TRUE(header.has_intensity);
  EXPECT_EQ(header.returns_per_shot, 1);
  EXPECT_EQ(header.time_reference, TimeReference::utc);
  ASSERT_EQ(header.devices.size(), 1U);
  EXPECT_EQ(header.devices[0].serial, "");
  EXPECT_EQ(header.devices[0].type, kUnknownDeviceType);
  EXPECT_TRUE(outcome.recording.warnings.empty());
  EXPECT_TRUE(outcome.recording.data.packets.empty());
  const auto time = static_cast<std::int64_t>(kUtc);
  const Observations& rows = outcome.rows();
  EXPECT_THAT(rows.time_ns, ElementsAre(time, time + 10'000, time + 20'000, time + 30'000));
  EXPECT_THAT(rows.range, ElementsAre(5.0, 0.0, 2.5, 7.0));
  EXPECT_THAT(rows.valid, ElementsAre(1, 0, 1, 1));
  EXPECT_THAT(rows.intensity, ElementsAre(17, 9, 255, 1));
  EXPECT_THAT(rows.tag, ElementsAre(0x10, 0, 0x05, 0));
  EXPECT_THAT(rows.beam, ElementsAre(2, 3, 5, 0));
  EXPECT_THAT(rows.return_number, ElementsAre(1, 1, 1, 1));
  EXPECT_THAT(rows.device, ElementsAre(0, 0, 0, 0));
  EXPECT_DOUBLE_EQ(rows.azimuth[0], std::atan2(4.0, 3.0));
  EXPECT_DOUBLE_EQ(rows.zenith[0], std::acos(0.0));
  EXPECT_TRUE(std::isnan(rows.azimuth[1]));
  EXPECT_TRUE(std::isnan(rows.zenith[1]));
  EXPECT_DOUBLE_EQ(std::fabs(rows.azimuth[2]), std::acos(-1.0));
  EXPECT_DOUBLE_EQ(rows.zenith[3], 0.0);
  EXPECT_FLOAT_EQ(rows.azimuth_resolution[0], 0.001F / 5.0F);
  EXPECT_FLOAT_EQ(rows.zenith_resolution[2], 0.001F / 2.5F);
  EXPECT_FLOAT_EQ(rows.range_resolution[2], 0.001F);
}

/// Single-return shots every 10 us, as a Mid-40 sends them.
inline std::vector<Point> shots(std::size_t count, float x = 2.0F, std::uint32_t step_ns = 10'000) {
  std::vector<Point> points;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto number = static_cast<float>(i);
    points.push_back({i * step_ns, x + 0.001F * number, 0.25F, -0.5F + 0.002F * number,
                      static_cast<std::uint8_t>(i)});
  }
  return points;
}

/// Of a PointCloud2.
struct Field {
  const char* name;
  std::uint32_t offset;
  std::uint8_t datatype;
};

}  // namespace risley::recordings::livox_points
