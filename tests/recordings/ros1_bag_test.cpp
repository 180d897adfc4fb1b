// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include <console_bridge/console.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>

#include "bags/written_bags.hpp"
#include "recordings/format_tests.hpp"
#include "recordings/livox_points.hpp"

namespace risley::recordings::ros1_bag_test {

using namespace bags::written;
using namespace format_tests;
using namespace livox_points;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

RawMessage custom(std::uint64_t timebase, const std::vector<Point>& points,
                  std::int64_t claimed_more = 0, std::uint8_t lidar = 1, std::uint64_t stamp = 0) {
  RawMessage message;
  message.type = "livox_ros_driver/CustomMsg";
  message.md5 = "e4d6829bdfe657cb6c21a746c86b21a6";
  message.definition =
      std::string(
          "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\n"
          "uint8[3] rsvd\nCustomPoint[] points\n") +
      kHeaderDefinition +
      "================================================================================\n"
      "MSG: livox_ros_driver/CustomPoint\nuint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\n"
      "uint8 reflectivity\nuint8 tag\nuint8 line\n";
  const auto count =
      static_cast<std::uint32_t>(static_cast<std::int64_t>(points.size()) + claimed_more);
  std::string& bytes = message.bytes;
  bytes = ros_header(stamp > 0 ? stamp : timebase + 137);  // which went through a double
  put<std::uint64_t>(bytes, timebase);
  put<std::uint32_t>(bytes, count);
  put<std::uint8_t>(bytes, lidar);
  bytes.append(3, '\0');
  put<std::uint32_t>(bytes, count);
  for (const Point& p : points) {
    put<std::uint32_t>(bytes, p.offset_ns);
    put<float>(bytes, p.x);
    put<float>(bytes, p.y);
    put<float>(bytes, p.z);
    bytes += {static_cast<char>(p.intensity), static_cast<char>(p.tag), static_cast<char>(p.line)};
  }
  return message;
}

struct Cloud {
  std::uint32_t height = 1, width = 0, point_step = 18, row_step = 0;
  bool big_endian = false;
  std::vector<Field> fields{{"x", 0, 7},          {"y", 4, 7},    {"z", 8, 7},
                            {"intensity", 12, 7}, {"tag", 16, 2}, {"line", 17, 2}};
  std::string data;
};

RawMessage cloud_message(std::uint64_t time_ns, const Cloud& cloud) {
  RawMessage message;
  message.type = "sensor_msgs/PointCloud2";
  message.md5 = "1158d486dd51d683ce2f1be655c3c181";
  message.definition =
      std::string(
          "std_msgs/Header header\nuint32 height\nuint32 width\nPointField[] fields\n"
          "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n") +
      kHeaderDefinition +
      "================================================================================\n"
      "MSG: sensor_msgs/PointField\nuint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\n"
      "uint8 INT32=5\nuint8 UINT32=6\nuint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\n"
      "uint32 offset\nuint8 datatype\nuint32 count\n";
  std::string& bytes = message.bytes;
  bytes = ros_header(time_ns);
  put<std::uint32_t>(bytes, cloud.height);
  put<std::uint32_t>(bytes, cloud.width);
  put<std::uint32_t>(bytes, static_cast<std::uint32_t>(cloud.fields.size()));
  for (const Field& field : cloud.fields) {
    put_text(bytes, field.name);
    put<std::uint32_t>(bytes, field.offset);
    put<std::uint8_t>(bytes, field.datatype);
    put<std::uint32_t>(bytes, 1);
  }
  put<std::uint8_t>(bytes, cloud.big_endian ? 1 : 0);
  put<std::uint32_t>(bytes, cloud.point_step);
  put<std::uint32_t>(bytes, cloud.row_step);
  put_text(bytes, cloud.data);
  put<std::uint8_t>(bytes, 1);
  return message;
}

/// A cloud as the driver sends it.
Cloud driver_cloud(std::size_t count, std::uint8_t line = 0) {
  Cloud cloud;
  cloud.width = static_cast<std::uint32_t>(count);
  for (std::size_t i = 0; i < count; ++i) {
    put<float>(cloud.data, 1.0F + 0.001F * static_cast<float>(i));
    put<float>(cloud.data, 0.5F);
    put<float>(cloud.data, -0.25F);
    put<float>(cloud.data, static_cast<float>(i % 256));
    put<std::uint8_t>(cloud.data, 0x10);
    put<std::uint8_t>(cloud.data, line);
  }
  return cloud;
}

RawMessage imu(std::uint64_t time_ns, double acceleration_z) {
  RawMessage message;
  message.type = "sensor_msgs/Imu";
  message.md5 = "6a62c6daae103f4ff57a132d6f95cec2";
  message.definition =
      std::string(
          "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
          "float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
          "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n"
          "float64[9] linear_acceleration_covariance\n") +
      kHeaderDefinition +
      "================================================================================\n"
      "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
      "================================================================================\n"
      "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
  message.bytes = ros_header(time_ns);
  for (int i = 0; i < 13; ++i) put<double>(message.bytes, 0.0);
  for (const double value : {0.25, -0.5, 0.125}) put<double>(message.bytes, value);
  for (int i = 0; i < 9; ++i) put<double>(message.bytes, -1.0);
  for (const double value : {0.0625, -0.03125, acceleration_z}) put<double>(message.bytes, value);
  for (int i = 0; i < 9; ++i) put<double>(message.bytes, -1.0);
  return message;
}

struct Bag : Ros1BagFile {
  std::string bytes() const {
    const TestFolder folder;
    write(folder.file("bag"));
    return get_bytes(folder.file("bag"));
  }
  Outcome read(std::size_t chunk_rows = kDefaultChunkRows) const {
    return read_text(kRos1BagFormat, bytes(), chunk_rows);
  }
};

Bag small_bag() {
  Bag bag;
  for (std::uint64_t i = 0; i < 6; ++i) {
    bag.add(kTopic, custom(kPowerOn + i * 200'000, shots(20)));
    bag.add("/livox/imu", imu(kPowerOn + i * 200'000, 1.0));
  }
  return bag;
}

TEST(Ros1Bag, ReadsEveryColumn) {
  Bag bag;
  bag.add(kTopic, custom(kUtc, kFirstPoints));
  bag.add(kTopic, custom(kUtc + 30'000, kNextPoints));
  expect_those_points(bag.read(), "ros1-bag");
}

TEST(Ros1Bag, TellsTheModelWhereOneIsLeft) {
  const auto type_of = [](std::vector<Point> points, auto&& change) {
    for (std::size_t i = 0; i < points.size(); ++i) change(points[i], i);
    Bag bag;
    bag.add(kTopic, custom(kPowerOn, points));
    const Outcome outcome = bag.read();
    EXPECT_EQ(outcome.recording.header.time_reference, TimeReference::power_on);
    return outcome.recording.header.devices.at(0).type;
  };
  const auto as_it_is = [](Point&, std::size_t) {};
  EXPECT_EQ(type_of(shots(100), as_it_is), 1);
  EXPECT_EQ(type_of(shots(100), [](Point& p, std::size_t) { p.tag = 0x10; }), 6);
  EXPECT_EQ(type_of(shots(96, 2.0F, 4167),
                    [](Point& p, std::size_t i) { p.line = static_cast<std::uint8_t>(i % 6); }),
            kUnknownDeviceType);
  EXPECT_EQ(type_of(shots(90),
                    [](Point& p, std::size_t i) {
                      p.offset_ns = static_cast<std::uint32_t>(i / 3 * 4167);
                      p.z -= 0.002F * static_cast<float>(i % 3);  // in the direction of the first
                    }),
            7);
}

TEST(Ros1Bag, ReturnsOfOneShotShareItsTime) {
  Bag bag;
  bag.add(kTopic, custom(kPowerOn, {{0, 1.0F, 0.0F, 0.0F, 5, 0x10},
                                    {0, 2.0F, 0.0F, 0.0F, 6, 0x20},
                                    {10'000, 3.0F, 0.0F, 0.0F, 7, 0x10},
                                    {10'000, 0.0F, 0.0F, 0.0F, 0, 0},
                                    {20'000, 0.0F, 0.0F, 0.0F, 0, 0},
                                    {20'000, 0.0F, 0.0F, 0.0F, 0, 0}}));
  const Outcome outcome = bag.read();
  EXPECT_EQ(outcome.recording.header.returns_per_shot, 2);
  EXPECT_EQ(outcome.recording.header.devices.at(0).type, 6);
  EXPECT_THAT(outcome.rows().return_number, ElementsAre(1, 2, 1, 2, 1, 2));
  EXPECT_THAT(outcome.rows().valid, ElementsAre(1, 1, 1, 0, 0, 0));
  EXPECT_EQ(outcome.rows().time_ns[3], static_cast<std::int64_t>(kPowerOn) + 10'000);
}

TEST(Ros1Bag, ManyPointsOfOneTimeAreNoReturns) {
  Bag bag;
  bag.add(kTopic, custom(kPowerOn, shots(300, 2.0F, 0)));
  const Outcome outcome = bag.read();
  EXPECT_EQ(outcome.recording.header.returns_per_shot, 1);
  EXPECT_EQ(outcome.rows().return_number, std::vector<std::uint8_t>(300, 1));
  EXPECT_THAT(warnings_of(outcome), ElementsAre(Warns(kWarning.times_coarse)));
}

TEST(Ros1Bag, CloudOfTheDriver) {
  Bag bag;
  for (std::uint64_t i = 0; i < 4; ++i) {
    bag.add(kTopic, cloud_message(kUtc + i * 1'000'000, driver_cloud(100)));
  }
  const Outcome outcome = bag.read(1);
  ASSERT_FALSE(outcome.error);
  ASSERT_EQ(outcome.rows().size(), 400U);
  EXPECT_TRUE(outcome.recording.header.has_intensity);
  EXPECT_EQ(outcome.recording.header.time_reference, TimeReference::utc);
  EXPECT_EQ(outcome.recording.header.devices.at(0).type, kUnknownDeviceType);
  for (std::size_t i = 0; i < 400; ++i) {
    ASSERT_EQ(outcome.rows().time_ns[i], static_cast<std::int64_t>(kUtc + 10'000 * i));
    ASSERT_EQ(outcome.rows().intensity[i], i % 100);
    ASSERT_EQ(outcome.rows().tag[i], 0x10);
  }
  EXPECT_THAT(warnings_of(outcome), ElementsAre(Warns(kWarning.no_shot_times)));
}

TEST(Ros1Bag, CloudGridFollowsFromStampsAndCounts) {
  struct Case {
    std::size_t points;  // in 100 ms
    int returns;
    double step_ns;
    const char* named;
  };
  const std::vector<Case> cases = {
      {10'000, 1, 10'000.0, "10 us"},
      {20'000, 2, 10'000.0, "10 us per shot, with 2 points"},
      {24'000, 1, 12'500.0 / 3, "4.1667 us"},
      {48'000, 2, 12'500.0 / 3, "4.1667 us per shot, with 2 points"},
      {72'000, 3, 12'500.0 / 3, "4.1667 us per shot, with 3 points"},
      {3'000, 1, 10'000.0, "30000 points per second"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.points);
    Bag bag;
    const Cloud cloud = driver_cloud(c.points, 1);
    for (std::uint64_t i = 0; i < 3; ++i) {
      bag.add(kTopic, cloud_message(kUtc + i * 100'000'000 + i * 200, cloud));
    }
    const Outcome outcome = bag.read();
    ASSERT_EQ(outcome.rows().size(), 3 * c.points);
    EXPECT_EQ(outcome.recording.header.returns_per_shot, c.returns);
    EXPECT_THAT(warnings_of(outcome), ElementsAre(Warns(kWarning.no_shot_times, {c.named})));
    for (std::size_t i = 0; i < c.points; ++i) {
      const std::size_t shot = i / static_cast<std::size_t>(c.returns);
      const auto since = outcome.rows().time_ns[i] - static_cast<std::int64_t>(kUtc);
      ASSERT_NEAR(static_cast<double>(since), static_cast<double>(shot) * c.step_ns, 0.5);
      ASSERT_EQ(outcome.rows().return_number[i], i % static_cast<std::size_t>(c.returns) + 1);
    }
  }
}

TEST(Ros1Bag, OneCloudAlone) {
  Bag bag;
  bag.add(kTopic, cloud_message(kUtc, driver_cloud(12, 3)));
  const Outcome outcome = bag.read();
  EXPECT_EQ(outcome.rows().time_ns[3], static_cast<std::int64_t>(kUtc) + 12'500);
  EXPECT_THAT(warnings_of(outcome), ElementsAre(Warns(kWarning.no_shot_times)));
}

TEST(Ros1Bag, CloudFieldsStandAnywhere) {
  Cloud cloud;
  cloud.height = 2;
  cloud.width = 2;
  cloud.point_step = 30;
  cloud.row_step = 64;
  cloud.fields = {{"line", 0, 4}, {"z", 3, 8}, {"rgb", 11, 7}, {"x", 12, 5}, {"y", 20, 3}};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double z : {2.0, nan, 0.0, -2.0}) {
    std::string point;
    put<std::uint16_t>(point, 5);
    point += '\x7f';
    put<double>(point, z);
    point += '\x7f';
    put<std::int32_t>(point, z == 0.0 ? 0 : 1);
    point.append(4, '\x7f');
    put<std::int16_t>(point, z == 0.0 ? 0 : -2);
    point.resize(30, '\x7f');
    cloud.data += point;
    if (cloud.data.size() == 60) cloud.data.append(4, '\x7f');
  }
  Bag bag;
  bag.add("/cloud", cloud_message(kPowerOn, cloud));
  const Outcome outcome = bag.read();
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  EXPECT_FALSE(outcome.recording.header.has_intensity);
  EXPECT_THAT(outcome.rows().range, ElementsAre(3.0, 0.0, 0.0, 3.0));
  EXPECT_THAT(outcome.rows().valid, ElementsAre(1, 0, 0, 1));
  EXPECT_THAT(outcome.rows().beam, ElementsAre(5, 5, 5, 5));
  EXPECT_THAT(outcome.rows().intensity, ElementsAre(0, 0, 0, 0));
  EXPECT_DOUBLE_EQ(outcome.rows().azimuth[0], std::atan2(-2.0, 1.0));
  EXPECT_DOUBLE_EQ(outcome.rows().zenith[3], std::acos(-2.0 / 3.0));
}

TEST(Ros1Bag, InertialSamples) {
  for (const double gravity : {1.0, 9.80665}) {
    Bag bag;
    bag.add(kTopic, custom(kPowerOn, shots(3)));
    bag.add("/livox/imu", imu(kPowerOn + 5, gravity));
    const Outcome outcome = bag.read(1);
    ASSERT_EQ(outcome.recording.data.imu.size(), 1U);
    const ImuSample& sample = outcome.recording.data.imu[0];
    EXPECT_EQ(sample.time_ns, static_cast<std::int64_t>(kPowerOn) + 5);
    EXPECT_EQ(sample.device, 0);
    EXPECT_THAT(sample.angular_velocity, ElementsAre(0.25F, -0.5F, 0.125F));
    EXPECT_FLOAT_EQ(sample.acceleration_g[2], 1.0F);
    EXPECT_FLOAT_EQ(sample.acceleration_g[0], static_cast<float>(0.0625 / gravity));
    EXPECT_EQ(outcome.recording.warnings.size(), gravity == 1.0 ? 0U : 1U);
  }
}

TEST(Ros1Bag, CompressedChunks) {
  Bag bag = small_bag();
  const Outcome plain = bag.read();
  ASSERT_FALSE(plain.error) << plain.error->what();
  ASSERT_EQ(plain.rows().size(), 120U);
  ASSERT_EQ(plain.recording.data.imu.size(), 6U);
  for (const auto compression : {rosbag::compression::BZ2, rosbag::compression::LZ4}) {
    bag.compression = compression;
    const Outcome packed = bag.read();
    ASSERT_FALSE(packed.error) << packed.error->what();
    EXPECT_TRUE(is_same(packed.rows(), plain.rows()));
    EXPECT_EQ(packed.recording.data.imu.size(), 6U);
  }
}

TEST(Ros1Bag, EachTopicIsADevice) {
  Bag bag;
  for (std::uint64_t i = 0; i < 3; ++i) {
    const std::uint64_t time = kPowerOn + i * 30'000;
    bag.add("/livox/lidar_3GGDJ9600100401", custom(time, shots(3, 3.0F)));
    bag.add("/livox/lidar_0TFDG3B006H2Z11", custom(time, shots(2, 2.0F)));
    bag.add("/livox/imu_3GGDJ9600100401", imu(time, 1.0));
    bag.add("/camera/imu", imu(time, 9.8));
    bag.add("/cloud_registered", cloud_message(time, driver_cloud(5)));
  }
  const Outcome outcome = bag.read(2);
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  const auto& devices = outcome.recording.header.devices;
  ASSERT_EQ(devices.size(), 2U);
  EXPECT_EQ(devices[0].serial, "0TFDG3B006H2Z11");
  EXPECT_EQ(devices[1].serial, "3GGDJ9600100401");
  EXPECT_EQ(devices[1].index, 1);
  EXPECT_THAT(outcome.rows().device, ElementsAre(1, 1, 1, 0, 0, 1, 1, 1, 0, 0, 1, 1, 1, 0, 0));
  ASSERT_EQ(outcome.recording.data.imu.size(), 3U);
  EXPECT_EQ(outcome.recording.data.imu[0].device, 1);
  EXPECT_THAT(warnings_of(outcome),
              ElementsAre(Warns(kWarning.content_left_out, {"/cloud_registered"}),
                          Warns(kWarning.content_left_out, {"/camera/imu"})));
}

TEST(Ros1Bag, AnyTypeNameWithTheSameMd5) {
  Bag bag;
  RawMessage message = custom(kPowerOn, shots(4));
  message.type = "livox_ros_driver2/CustomMsg";
  bag.add("/points_192_168_1_12", message);
  message.type = "my_driver/CustomMsg";
  bag.add("/points_192_168_1_12", message);
  const Outcome outcome = bag.read();
  EXPECT_EQ(outcome.rows().size(), 8U);
  ASSERT_EQ(outcome.recording.header.devices.size(), 1U);
  EXPECT_EQ(outcome.recording.header.devices[0].serial, "");
}

TEST(Ros1Bag, OpeningAndReadingCanBeCancelled) {
  const TestFolder folder;
  const std::string path = folder.file("input.bag");
  small_bag().write(path);
  CancelFlag flag;
  const Progress progress([](double) {}, &flag);
  const auto reader = open_recording(path, {}, progress);
  flag.set();
  Chunk chunk;
  EXPECT_THROW(reader->read(chunk), Cancelled);
  EXPECT_THROW(open_recording(path, {}, progress), Cancelled);
}

TEST(Ros1Bag, OpensByContent) {
  const TestFolder folder;
  const std::string path = folder.file("without_ending");
  small_bag().write(path);
  const Recording recording = load_recording(path);
  EXPECT_EQ(recording.header.format, "ros1-bag");
  EXPECT_EQ(recording.data.observations.size(), 120U);
  const std::string copy = folder.file("copy.nc");
  write_all(kNetcdfFormat, copy, recording.header, recording.data);
  EXPECT_TRUE(is_same(read_all(kNetcdfFormat, copy).rows(), recording.data.observations));
}

TEST(Ros1Bag, CutAnywhere) {
  for (const auto compression : {rosbag::compression::Uncompressed, rosbag::compression::LZ4}) {
    Bag bag = small_bag();
    bag.compression = compression;
    const std::string bytes = bag.bytes();
    for (std::size_t length = 0; length < bytes.size(); length += 97) {
      SCOPED_TRACE(length);
      const Outcome outcome = read_text(kRos1BagFormat, std::string_view(bytes).substr(0, length));
      expect_damage(outcome, NamesField("rosbag reindex"), 0);
      ASSERT_TRUE(outcome.error->place().byte_offset);
    }
  }
}

TEST(Ros1Bag, SurvivesAnyChangedByte) {
  for (const auto compression :
       {rosbag::compression::Uncompressed, rosbag::compression::BZ2, rosbag::compression::LZ4}) {
    Bag bag = small_bag();
    bag.compression = compression;
    const std::string bytes = bag.bytes();
    for (std::size_t at = 13; at < bytes.size(); at += at < 4000 && at > 200 ? 997 : 23) {
      SCOPED_TRACE(at);
      std::string changed = bytes;
      changed[at] = static_cast<char>(changed[at] ^ (1 << (at % 8)));
      ASSERT_LE(read_text(kRos1BagFormat, changed).rows().size(), 200U);
    }
  }
}

TEST(Ros1Bag, NotClosed) {
  std::string bytes = small_bag().bytes();
  bytes.replace(bytes.find("index_pos=") + 10, 8, 8, '\0');
  expect_damage(read_text(kRos1BagFormat, bytes), NamesField("rosbag reindex"));
}

TEST(Ros1Bag, WithoutLidarMessages) {
  expect_damage(Bag().read(), NamesField("topic"));

  Bag bag;
  RawMessage message = custom(kPowerOn, shots(4));
  message.md5 = "0123456789abcdef0123456789abcdef";
  bag.add(kTopic, message);
  bag.add("/imu", imu(kPowerOn, 1.0));
  const Outcome other = bag.read();
  ASSERT_TRUE(other.error);
  EXPECT_FALSE(other.opened);
  EXPECT_THAT(other.error->problem(), NamesField("/imu (sensor_msgs/Imu)"));
  EXPECT_THAT(other.error->problem(), AllOf(NamesField("/livox/lidar (livox_ros_driver/CustomMsg"),
                                            HasSubstr("md5 0123456789")));
}

TEST(Ros1Bag, DamagedMessagesAreNamed) {
  struct Case {
    const char* name;
    RawMessage message;
    const char* named;
  };
  std::vector<Case> cases;
  cases.push_back({"count", custom(kPowerOn, shots(4), 1),
                   "5 points of at least 19 bytes each, found 76 bytes"});
  cases.push_back({"huge count", custom(kPowerOn, shots(4), 4'294'967'000), "4294967004 points"});
  cases.push_back({"fewer", custom(kPowerOn, shots(4), -1), "19 more bytes"});
  cases.push_back({"time", custom(~std::uint64_t{0}, shots(4)), "2200"});
  cases.push_back({"nan", custom(kPowerOn, shots(4)), "point 2"});
  const float nan = std::nanf("");
  std::memcpy(cases.back().message.bytes.data() + cases.back().message.bytes.size() - 3 * 19 + 4,
              &nan, sizeof nan);
  cases.push_back({"frame name", custom(kPowerOn, shots(4)), "frame name"});
  cases.back().message.bytes[14] = '\x7f';
  cases.push_back({"nothing", custom(kPowerOn, {}), "sequence number"});
  cases.back().message.bytes.clear();
  for (const Case& c : cases) {
    for (const std::size_t chunk_rows : {std::size_t{1}, kDefaultChunkRows}) {
      SCOPED_TRACE(c.name);
      Bag bag;
      bag.add(kTopic, custom(kPowerOn, shots(4)));
      bag.add("/livox/imu", imu(kPowerOn, 1.0));
      bag.add(kTopic, c.message);
      bag.add(kTopic, custom(kPowerOn, shots(4)));
      const Outcome outcome = bag.read(chunk_rows);
      expect_damage(outcome,
                    AllOf(NamesField("message 2 of topic /livox/lidar"), NamesField(c.named)), 4);
      EXPECT_EQ(outcome.recording.data.imu.size(), 1U);
    }
  }
}

TEST(Ros1Bag, BigEndianCloudsWithPaddingAreRead) {
  // Every number the other way round, and holes between points and behind rows.
  Cloud big;
  big.big_endian = true;
  big.height = 2;
  big.width = 20;
  big.point_step = 32;
  big.row_step = 20 * 32 + 24;
  big.fields = {{"x", 0, 7},    {"y", 4, 7},     {"z", 8, 7},         {"intensity", 14, 4},
                {"tag", 16, 2}, {"line", 17, 2}, {"timestamp", 20, 8}};
  const auto put_big = [&big](auto value) {
    std::string bytes;
    put<decltype(value)>(bytes, value);
    std::reverse(bytes.begin(), bytes.end());
    big.data += bytes;
  };
  for (std::size_t i = 0; i < 40; ++i) {
    put_big(1.0F + 0.001F * static_cast<float>(i));
    put_big(0.5F);
    put_big(-0.25F);
    big.data += "zz";
    put_big(static_cast<std::uint16_t>(i));
    put_big(std::uint8_t{16});
    put_big(std::uint8_t{3});
    big.data += "zz";
    put_big(1e-5 * static_cast<double>(i));
    big.data += "zzzz";
    if (i % 20 == 19) big.data += std::string(24, 'z');
  }
  Bag bag;
  bag.add(kTopic, cloud_message(kPowerOn, big));
  const Outcome outcome = bag.read();
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  const Observations& rows = outcome.rows();
  ASSERT_EQ(rows.size(), 40U);
  EXPECT_TRUE(outcome.recording.warnings.empty());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double x = 1.0F + 0.001F * static_cast<float>(i);
    EXPECT_NEAR(rows.range[i], std::hypot(x, 0.5, 0.25), 1e-12);
    EXPECT_NEAR(rows.azimuth[i], std::atan2(0.5, x), 1e-12);
    EXPECT_EQ(rows.intensity[i], i);
    EXPECT_EQ(rows.tag[i], 16);
    EXPECT_EQ(rows.beam[i], 3);
    EXPECT_EQ(rows.time_ns[i] - rows.time_ns[0], static_cast<std::int64_t>(i) * 10'000);
  }
}

TEST(Ros1Bag, DamagedCloudsAreNamed) {
  const auto check = [](const char* named, auto&& change) {
    SCOPED_TRACE(named);
    Cloud cloud = driver_cloud(4);
    change(cloud);
    Bag bag;
    bag.add(kTopic, cloud_message(kPowerOn, driver_cloud(4)));
    bag.add(kTopic, cloud_message(kPowerOn + 40'000, cloud));
    expect_damage(bag.read(),
                  AllOf(NamesField("message 2 of topic /livox/lidar"), NamesField(named)), 4);
  };
  check("found x, y", [](Cloud& c) { c.fields.resize(2); });
  check("found none", [](Cloud& c) { c.fields.clear(); });
  check("field z, found 9", [](Cloud& c) { c.fields[2].datatype = 9; });
  check("field z takes bytes 15 to 18", [](Cloud& c) { c.fields[2].offset = 15; });
  check("field line", [](Cloud& c) { c.fields[5].offset = ~0U; });
  check("1 x 5 points of 18 bytes, found 72 bytes", [](Cloud& c) { c.width = 5; });
  check("4294967295 x 4 points of 18 bytes", [](Cloud& c) { c.height = c.row_step = ~0U; });
  check("36 bytes in the point cloud, found 0", [](Cloud& c) { c.height = c.width = 2; });
}

TEST(Ros1Bag, AClaimedChunkCostsNoMemory) {
  Bag bag;
  bag.compression = rosbag::compression::BZ2;
  bag.add(kTopic, custom(kPowerOn, shots(20)));
  std::string bytes = bag.bytes();
  // The header of the chunk: "compression=bz2", then the field "size".
  const std::size_t at = bytes.find("size=", bytes.find("compression=bz2") - 64) + 5;
  bytes.replace(at, 4, std::string("\0\0\0\x40", 4));  // 1 GiB
  expect_little_memory(
      [&] { expect_damage(read_text(kRos1BagFormat, bytes), NamesField("unpacked chunk")); });
}

TEST(Ros1Bag, ReadersOfSeveralThreadsLeaveTheLoggingAsItWas) {
  const TestFolder folder;
  const std::string path = folder.file("input.bag");
  small_bag().write(path);
  console_bridge::OutputHandler* const handler = console_bridge::getOutputHandler();
  ASSERT_NE(handler, nullptr);
  std::atomic<std::size_t> rows = 0;
  std::vector<std::thread> threads;
  for (int thread = 0; thread < 8; ++thread) {
    threads.emplace_back([&] {
      for (int i = 0; i < 20; ++i) rows += read_all(kRos1BagFormat, path).rows().size();
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(rows, 160 * read_all(kRos1BagFormat, path).rows().size());
  EXPECT_EQ(console_bridge::getOutputHandler(), handler);
}

TEST(Ros1Bag, LidarsOfOneTopicAreToldApartByTheirNumbers) {
  Bag bag;
  for (std::uint64_t i = 0; i < 6; ++i) {
    for (const std::uint8_t lidar : std::vector<std::uint8_t>{0, 1, 4}) {
      bag.add(kTopic, custom(kPowerOn + i * 500'000 + 137 * lidar,
                             shots(50, 2.0F + static_cast<float>(lidar)), 0, lidar));
    }
  }
  const Outcome outcome = bag.read();
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  ASSERT_EQ(outcome.recording.header.devices.size(), 3U);
  EXPECT_EQ(outcome.recording.header.devices[2].topic, kTopic);
  EXPECT_EQ(outcome.recording.header.devices[2].index, 2);
  const Observations& rows = outcome.rows();
  ASSERT_EQ(rows.size(), 900U);
  for (std::size_t row = 0; row < rows.size(); row += 50) {
    const std::size_t device = row / 50 % 3;
    EXPECT_EQ(rows.device[row], device);
    const double x[] = {2.0, 3.0, 6.0};
    EXPECT_NEAR(rows.range[row], std::hypot(x[device], 0.25, 0.5), 1e-6);
  }
  EXPECT_EQ(outcome.recording.warnings.size(), 1U);
}

TEST(Ros1Bag, OffsetsThatGrowOverMessagesCountFromTheFirst) {
  Bag bag;
  constexpr std::uint64_t kMessage = 100'000'000;
  for (std::uint64_t i = 0; i < 50; ++i) {  // beyond the 4.3 s that an offset holds
    std::vector<Point> points = shots(10);
    for (Point& point : points) point.offset_ns += static_cast<std::uint32_t>(i * kMessage);
    bag.add(kTopic, custom(kPowerOn + i * kMessage, points));
  }
  const Outcome outcome = bag.read();
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  const Observations& rows = outcome.rows();
  ASSERT_EQ(rows.size(), 500U);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    ASSERT_EQ(rows.time_ns[row],
              static_cast<std::int64_t>(kPowerOn + row / 10 * kMessage + row % 10 * 10'000));
  }
  EXPECT_THAT(warnings_of(outcome), ElementsAre(Warns(kWarning.times_corrected)));
}

TEST(Ros1Bag, StampsInUtcBesideTimesFromPowerOnAreCompared) {
  Bag bag;
  for (std::uint64_t i = 0; i < 5; ++i) {
    bag.add(kTopic, custom(kPowerOn + i * 200'000, shots(20), 0, 1, kUtc + i * 200'000));
  }
  const Outcome outcome = bag.read();
  EXPECT_EQ(outcome.recording.header.time_reference, TimeReference::power_on);
  ASSERT_TRUE(outcome.recording.header.stamps_after_times_ns);
  EXPECT_EQ(*outcome.recording.header.stamps_after_times_ns,
            static_cast<std::int64_t>(kUtc - kPowerOn));
  EXPECT_FALSE(small_bag().read().recording.header.stamps_after_times_ns);
}

TEST(Ros1Bag, PointsOfOneTimeInOtherDirectionsAreNoReturns) {
  Bag bag;
  std::vector<Point> points = shots(60);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].offset_ns = static_cast<std::uint32_t>(i / 3 * 30'000);
    points[i].y = 0.1F * static_cast<float>(i);
  }
  bag.add(kTopic, custom(kPowerOn, points));
  const Outcome outcome = bag.read();
  EXPECT_EQ(outcome.recording.header.returns_per_shot, 1);
  for (const std::uint8_t number : outcome.rows().return_number) EXPECT_EQ(number, 1);
}

}  // namespace risley::recordings::ros1_bag_test
