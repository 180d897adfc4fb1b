// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Messages of the second generation's driver, livox_ros_driver2.
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "recordings/formats/cartesian.hpp"
#include "recordings/formats/livox_messages.hpp"
#include "recordings/ros2_messages.hpp"
#include "wire/hex.hpp"

namespace risley::recordings::numbered_messages_test {

using namespace ros2_messages;
using namespace format_tests;
using ::testing::ElementsAre;
using wire::bytes_of;

constexpr std::uint64_t kTimebase = 1'700'000'000'123'456'789;

Outcome read(const Ros2BagFile& bag) {
  const TestFolder folder;
  bag.write(folder.file("bag")).reset();
  return read_text(kRos2BagFormat, get_bytes(folder.file("bag")));
}

TEST(NumberedMessages, KnownMessages) {
  const char* ros1 =
      "01000000 00F15365 15CD5B07 0B000000 6C69766F785F6672616D65 15CD853DFE9C9717 02000000 C0 "
      "000000 02000000 00000000B6F39D3F2DB2B5C06666663F2A1500 "
      "881300000000000000000000000000003C0001";
  const char* ros2 =
      "00010000 00F15365 15CD5B07 0C000000 6C69766F785F6672616D6500 15CD853DFE9C9717 02000000 C0 "
      "000000 02000000 00000000B6F39D3F2DB2B5C06666663F2A1500 00 "
      "881300000000000000000000000000003C0001";
  for (const bool first : {true, false}) {
    LidarMessage message;
    const std::vector<std::uint8_t> bytes = bytes_of(first ? ros1 : ros2);
    decode_lidar_message(MessageKind::points,
                         first ? bags::Serialisation::ros1 : bags::Serialisation::cdr, bytes,
                         message);
    EXPECT_EQ(message.time_ns, static_cast<std::int64_t>(kTimebase));
    EXPECT_EQ(message.lidar, 192);
    ASSERT_EQ(message.points.size(), 2U);
    EXPECT_FLOAT_EQ(static_cast<float>(message.points[0].y), -5.678F);
    EXPECT_EQ(message.points[0].tag, 0x15);
    EXPECT_EQ(message.points[0].intensity, 42);
    EXPECT_EQ(message.points[1].offset_ns, 5000);
    EXPECT_EQ(message.points[1].intensity, 60);
    EXPECT_EQ(message.points[1].line, 1);
  }
}

/// Points of packets as the driver writes them: 4947 ns apart within packets.
std::vector<Point> driver_points(std::size_t packets, bool names_lines, std::size_t dropped = 0) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < packets * 96; ++i) {
    if (dropped > 0 && i % dropped == dropped - 1) continue;
    const auto offset = static_cast<std::uint32_t>(i / 96 * 480'000 + i % 96 * 4947);
    const auto number = static_cast<float>(i % 1000);
    points.push_back({offset, (1234.0F + number) / 1000, (-500.0F + number) / 1000, 0.321F, 9, 0x10,
                      static_cast<std::uint8_t>(names_lines ? i % 4 : 0)});
  }
  return points;
}

TEST(NumberedMessages, PointsArePutBackToWhenTheyWereFired) {
  for (const bool names_lines : {true, false}) {
    for (const std::size_t dropped : {std::size_t{0}, std::size_t{7}}) {
      Ros2BagFile bag;
      const std::size_t lidar = bag.topic("/livox/lidar_192_168_1_112", kCustomType);
      const std::size_t inertia = bag.topic("/livox/imu_192_168_1_112", kImuType);
      for (std::uint64_t i = 0; i < 3; ++i) {
        bag.add(lidar,
                custom(kTimebase + i * 99'840'000, driver_points(208, names_lines, dropped)));
        bag.add(inertia, imu(kTimebase + i * 99'840'000));
      }
      const Outcome outcome = read(bag);
      ASSERT_FALSE(outcome.error) << outcome.error->what();
      const Device& device = outcome.recording.header.devices.at(0);
      EXPECT_EQ(device.type, kMid360);
      EXPECT_TRUE(device.type_inferred);
      EXPECT_EQ(device.address, "192.168.1.112");
      EXPECT_EQ(outcome.recording.data.imu.size(), 3U);
      EXPECT_THAT(warnings_of(outcome), ElementsAre(Warns(kWarning.times_corrected)));
      const Observations& o = outcome.rows();
      std::size_t shot = 0;
      for (std::size_t row = 0; row < o.size(); ++row, ++shot) {
        if (dropped > 0 && shot % 19'968 % dropped == dropped - 1) ++shot;
        const auto expected = static_cast<std::int64_t>(kTimebase + shot * 5000);
        ASSERT_EQ(o.time_ns[row], expected) << row;
        ASSERT_EQ(o.beam[row], shot % 4) << row;
      }
      // Whole millimetres, and not the nearest floats.
      Observations exact;
      exact.resize(1);
      const double x = 1234 * kMillimetre, y = -500 * kMillimetre, z = 321 * kMillimetre;
      set_cartesian(exact, 0, 1, &x, &y, &z, kMillimetre);
      EXPECT_EQ(o.azimuth[0], exact.azimuth[0]);
      EXPECT_EQ(o.range[0], exact.range[0]);
    }
  }
}

TEST(NumberedMessages, SeveralSensorsHaveTopicsOfTheirOwn) {
  Ros2BagFile bag;
  for (const char* last : {"112", "7"}) {
    const std::size_t lidar = bag.topic(std::string("/livox/lidar_192_168_1_") + last, kCustomType);
    const std::size_t inertia = bag.topic(std::string("/livox/imu_192_168_1_") + last, kImuType);
    for (std::uint64_t i = 0; i < 3; ++i) {
      bag.add(lidar, custom(kTimebase + i * 960'000, driver_points(2, true)));
      bag.add(inertia, imu(kTimebase + i * 960'000));
    }
  }
  const Outcome outcome = read(bag);
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  ASSERT_EQ(outcome.recording.header.devices.size(), 2U);
  EXPECT_EQ(outcome.recording.header.devices[1].address, "192.168.1.7");
  ASSERT_EQ(outcome.recording.data.imu.size(), 6U);
  EXPECT_THAT(outcome.recording.data.imu[5].device, 1);
}

/// PointXYZRTLT: x y z intensity tag line timestamp, packed.
std::string numbered_cloud(std::uint64_t time_ns, const std::vector<Point>& points) {
  Cdr cdr;
  const std::vector<Field> fields = {{"x", 0, 7},          {"y", 4, 7},    {"z", 8, 7},
                                     {"intensity", 12, 7}, {"tag", 16, 2}, {"line", 17, 2},
                                     {"timestamp", 18, 8}};
  const auto count = static_cast<std::uint32_t>(points.size());
  constexpr std::uint32_t kStep = 26;
  cdr.header(time_ns).put<std::uint32_t>(1).put<std::uint32_t>(count);
  cdr.put<std::uint32_t>(static_cast<std::uint32_t>(fields.size()));
  for (const Field& field : fields) {
    cdr.text(field.name).put<std::uint32_t>(field.offset).put<std::uint8_t>(field.datatype);
    cdr.put<std::uint32_t>(1);
  }
  cdr.put<std::uint8_t>(0).put<std::uint32_t>(kStep).put<std::uint32_t>(kStep * count);
  std::string data;
  const auto put = [&data](auto value) {
    data.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (const Point& point : points) {
    for (const float value : {point.x, point.y, point.z, static_cast<float>(point.intensity)}) {
      put(value);
    }
    put(point.tag);
    put(point.line);
    put(static_cast<double>(time_ns + point.offset_ns));
  }
  cdr.put<std::uint32_t>(kStep * count).raw(data);
  return cdr.put<std::uint8_t>(1).bytes();
}

TEST(NumberedMessages, CloudsOfTheDriver) {
  // One point of it is known.
  const auto known = numbered_cloud(kTimebase, {{0, 1.234F, -5.678F, 0.9F, 42, 0x15, 0}});
  const auto point = bytes_of("B6F39D3F 2DB2B5C0 6666663F 00002842 15 00 CD853DFE9C97B743");
  EXPECT_NE(known.find(std::string(point.begin(), point.end())), std::string::npos);

  Ros2BagFile bag;
  const std::size_t lidar = bag.topic("/livox/lidar", kCloudType);
  for (std::uint64_t i = 0; i < 3; ++i) {
    bag.add(lidar, numbered_cloud(kTimebase + i * 99'840'000, driver_points(208, true)));
  }
  const Outcome outcome = read(bag);
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  EXPECT_EQ(outcome.recording.header.devices.at(0).type, kMid360);
  const Observations& o = outcome.rows();
  ASSERT_EQ(o.size(), 3U * 208 * 96);
  for (std::size_t row = 0; row < o.size(); ++row) {
    const auto expected = static_cast<std::int64_t>(kTimebase + row * 5000);
    ASSERT_LE(std::abs(o.time_ns[row] - expected), 256) << row;  // steps of doubles at this time
    ASSERT_EQ(o.beam[row], row % 4);
    ASSERT_EQ(o.tag[row], 0x10);
  }
}

}  // namespace risley::recordings::numbered_messages_test
