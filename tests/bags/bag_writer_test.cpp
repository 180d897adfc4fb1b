// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/bags/bag_writer.hpp"

#include <filesystem>
#include <fstream>
#include <map>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/bags/messages.hpp"
#include "risley/core/error.hpp"

#include "bags/written_mcap.hpp"
#include "io/test_folder.hpp"

namespace risley::bags::bag_writer_test {

using io::TestFolder;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

struct Kept {
  std::string topic, bytes;
  std::uint64_t time_ns = 0, publish_time_ns = 0;

  bool operator==(const Kept&) const = default;
};

std::vector<Kept> messages_of(Bag& bag) {
  std::vector<Kept> kept;
  bag.rewind(std::vector<bool>(bag.topics().size(), true));
  for (Message message; bag.next(message);) {
    kept.push_back({bag.topics()[message.topic].name,
                    {message.bytes.begin(), message.bytes.end()},
                    message.time_ns,
                    message.publish_time_ns});
  }
  EXPECT_THAT(bag.warnings(), IsEmpty());
  return kept;
}

Message message_of(const Kept& kept) {
  Message message;
  message.bytes = {reinterpret_cast<const std::uint8_t*>(kept.bytes.data()), kept.bytes.size()};
  message.time_ns = kept.time_ns;
  message.publish_time_ns = kept.publish_time_ns;
  return message;
}

/// An IMU and two cameras, one with details and one without.
std::vector<Topic> topics_of(Serialisation serialisation) {
  std::vector<Topic> topics;
  topics.push_back(topic_of("/imu", WrittenMessage::imu, serialisation));
  Topic camera;
  camera.name = "/camera";
  camera.serialisation = serialisation;
  camera.type = camera.stored.type =
      serialisation == Serialisation::ros1 ? "sensor_msgs/Image" : "sensor_msgs/msg/Image";
  camera.stored.md5 = "060021388200f6f0f447d0fcd9c64743";
  camera.stored.definition_format = serialisation == Serialisation::ros1 ? "ros1msg" : "ros2msg";
  camera.stored.definition = "uint8[] \"data\"\n";
  if (serialisation == Serialisation::ros1) {
    camera.stored.details = {{"callerid", "/a \"node\""}, {"latching", "1"}};
  } else {
    camera.stored.details = {{"offered_qos_profiles", "- history: 3\n  depth: \"0\""}};
  }
  topics.push_back(camera);
  Topic other = camera;
  other.name = "/other";
  other.stored.details.clear();
  topics.push_back(other);
  return topics;
}

/// Messages of all sizes, in the order of their times.
std::vector<Kept> some_messages(std::size_t count, std::size_t longest, BagKind kind) {
  std::mt19937 random(7);
  std::vector<Kept> messages;
  const char* names[] = {"/imu", "/camera", "/other"};
  for (std::size_t i = 0; i < count; ++i) {
    std::string bytes(random() % longest, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    const std::uint64_t time = 1'700'000'000'000'000'001 + i * 1'000'003;
    messages.push_back({names[random() % 3], bytes, time, kind == BagKind::mcap ? time - 5 : time});
  }
  messages[1].bytes.clear();
  return messages;
}

struct Case {
  BagKind kind;
  Serialisation serialisation;
  const char* name;
};

class BagWriters : public ::testing::TestWithParam<Case> {
 protected:
  std::string write(const std::vector<Topic>& topics, const std::vector<Kept>& messages) {
    std::string path = folder_.file(GetParam().name);
    const auto writer = create_bag(path, GetParam().kind);
    std::map<std::string, std::size_t> numbers;
    for (const Topic& topic : topics) numbers[topic.name] = writer->add(topic);
    for (const Kept& one : messages) writer->write(numbers.at(one.topic), message_of(one));
    writer->close();
    return path;
  }

  TestFolder folder_;
};

INSTANTIATE_TEST_SUITE_P(Kinds, BagWriters,
                         ::testing::Values(Case{BagKind::ros1, Serialisation::ros1, "out.bag"},
                                           Case{BagKind::ros2, Serialisation::cdr, "out.db3"},
                                           Case{BagKind::mcap, Serialisation::cdr, "out.mcap"},
                                           Case{BagKind::mcap, Serialisation::ros1, "ros1.mcap"}));

TEST_P(BagWriters, ReadersHaveEveryByteAndTime) {
  const std::vector<Topic> topics = topics_of(GetParam().serialisation);
  const std::vector<Kept> messages = some_messages(400, 30'000, GetParam().kind);
  const std::unique_ptr<Bag> bag = open_bag(write(topics, messages));
  EXPECT_EQ(bag->kind(), GetParam().kind);
  EXPECT_TRUE(messages_of(*bag) == messages);
  ASSERT_EQ(bag->topics().size(), topics.size());
  for (const Topic& topic : topics) {
    const auto found = std::ranges::find(bag->topics(), topic.name, &Topic::name);
    ASSERT_NE(found, bag->topics().end());
    EXPECT_EQ(found->serialisation, topic.serialisation);
    EXPECT_EQ(found->stored.type, topic.stored.type);
    EXPECT_EQ(found->stored.definition, topic.stored.definition);
    EXPECT_EQ(found->stored.definition_format, topic.stored.definition_format);
    if (topic.serialisation == Serialisation::ros1) {
      EXPECT_EQ(found->stored.md5, topic.stored.md5);
    }
    for (const auto& detail : topic.stored.details) {
      EXPECT_THAT(found->stored.details, ::testing::Contains(detail));
    }
  }
  EXPECT_EQ(std::ranges::find(bag->topics(), "/imu", &Topic::name)->kind, MessageKind::imu);
}

TEST_P(BagWriters, ABagOfNothingIsWhole) {
  const std::unique_ptr<Bag> bag = open_bag(write({}, {}));
  EXPECT_THAT(bag->topics(), IsEmpty());
  EXPECT_THAT(messages_of(*bag), IsEmpty());
}

TEST_P(BagWriters, WhatIsNotClosedLeavesNothing) {
  const std::string path = folder_.file(GetParam().name);
  {
    const auto writer = create_bag(path, GetParam().kind);
    const std::vector<Topic> topics = topics_of(GetParam().serialisation);
    for (const Topic& topic : topics) writer->add(topic);
    for (const Kept& one : some_messages(20, 3000, GetParam().kind)) {
      writer->write(0, message_of(one));
    }
  }
  EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(path).parent_path()));
}

TEST_P(BagWriters, ReplaceWhatWasThere) {
  const std::vector<Topic> topics = topics_of(GetParam().serialisation);
  write(topics, some_messages(50, 100, GetParam().kind));
  const std::vector<Kept> later = some_messages(9, 100, GetParam().kind);
  EXPECT_TRUE(messages_of(*open_bag(write(topics, later))) == later);
}

TEST(BagWriter, RefusesWhatItsKindDoesNotHold) {
  const TestFolder folder;
  const Topic of_ros1 = topic_of("/imu", WrittenMessage::imu, Serialisation::ros1),
              of_ros2 = topic_of("/imu", WrittenMessage::imu, Serialisation::cdr);
  EXPECT_THROW(create_bag(folder.file("a.bag"), BagKind::ros1)->add(of_ros2), InvalidArgument);
  EXPECT_THROW(create_bag(folder.file("a.db3"), BagKind::ros2)->add(of_ros1), InvalidArgument);
  const auto bag = create_bag(folder.file("a.bag"), BagKind::ros1);
  const std::size_t topic = bag->add(of_ros1);
  EXPECT_THROW(bag->write(topic, {}), InvalidArgument);  // at 0, which ROS has for no time
}

TEST(BagWriter, ChoosesTheKindByTheEnding) {
  EXPECT_EQ(bag_kind_of_name("a.BAG"), BagKind::ros1);
  EXPECT_EQ(bag_kind_of_name("a.db3"), BagKind::ros2);
  EXPECT_EQ(bag_kind_of_name("a.mcap"), BagKind::mcap);
  EXPECT_EQ(bag_kind_of_name("a.las"), std::nullopt);
}

TEST(Messages, AreWhatTheyWereWhenEncodedAndDecoded) {
  for (const Serialisation serialisation : {Serialisation::ros1, Serialisation::cdr}) {
    // Names of all lengths, for every alignment of what follows.
    for (const char* frame : {"", "a", "ab", "abc", "livox_frame"}) {
      std::vector<std::uint8_t> bytes, data(60);
      for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::uint8_t>(i);
      PointCloud2 cloud, cloud_found;
      cloud.header = {1'700'000'000, 5, frame, serialisation == Serialisation::ros1 ? 3U : 0U};
      cloud.height = 1;
      cloud.width = 2;
      cloud.fields = {{"x", 0, kFloat32Field}, {"longer", 4, kUint8Field, 3}};
      cloud.point_step = 30;
      cloud.row_step = 60;
      cloud.data = data;
      encode(serialisation, cloud, bytes);
      decode(serialisation, bytes, cloud_found);
      EXPECT_EQ(cloud_found.header.seconds, cloud.header.seconds);
      EXPECT_EQ(cloud_found.header.frame, frame);
      EXPECT_EQ(cloud_found.header.sequence, cloud.header.sequence);
      ASSERT_EQ(cloud_found.fields.size(), 2U);
      EXPECT_EQ(cloud_found.fields[1].name, "longer");
      EXPECT_EQ(cloud_found.fields[1].count, 3U);
      EXPECT_TRUE(std::ranges::equal(cloud_found.data, data));
      EXPECT_TRUE(cloud_found.is_dense);

      CustomMessage custom, custom_found;
      custom.header.frame = frame;
      custom.timebase = 1'700'000'000'000'000'007;
      custom.point_num = 3;
      custom.lidar_id = 9;
      custom.points = {std::span(data).first(57), 3};
      encode(serialisation, custom, bytes);
      decode(serialisation, bytes, custom_found);
      EXPECT_EQ(custom_found.timebase, custom.timebase);
      EXPECT_EQ(custom_found.lidar_id, 9);
      ASSERT_EQ(custom_found.points.count, 3U);
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(custom_found.points[i].offset_time, custom.points[i].offset_time);
        EXPECT_EQ(custom_found.points[i].line, 19 * i + 18);
      }

      ImuMessage imu, imu_found;
      imu.header.frame = frame;
      imu.angular_velocity = {1, 2, 3};
      imu.linear_acceleration = {4, 5, 6};
      encode(serialisation, imu, bytes);
      decode(serialisation, bytes, imu_found);
      EXPECT_EQ(imu_found.orientation_covariance[0], -1);
      EXPECT_EQ(imu_found.angular_velocity.z, 3);
      EXPECT_EQ(imu_found.linear_acceleration.x, 4);
    }
  }
}

TEST(Messages, AreEncodedAsOthersDoIt) {
  written::Cdr expected;
  expected.header(1'700'000'000'000'000'005, "abc")
      .put<std::uint64_t>(77)
      .put<std::uint32_t>(2)
      .put<std::uint8_t>(4);
  for (int i = 0; i < 3; ++i) expected.put<std::uint8_t>(0);
  expected.put<std::uint32_t>(2);
  std::string points;
  for (const std::uint32_t offset : {7U, 8U}) {
    expected.put<std::uint32_t>(offset).put<float>(1.5F).put<float>(-2).put<float>(0.25F);
    written::put<std::uint32_t>(points, offset);
    for (const float value : {1.5F, -2.0F, 0.25F}) written::put<float>(points, value);
    for (const std::uint8_t byte : {std::uint8_t{200}, std::uint8_t{16}, std::uint8_t{3}}) {
      expected.put<std::uint8_t>(byte);
      written::put<std::uint8_t>(points, byte);
    }
  }
  CustomMessage message;
  message.header = {1'700'000'000, 5, "abc", 0};
  message.timebase = 77;
  message.point_num = 2;
  message.lidar_id = 4;
  message.points = {{reinterpret_cast<const std::uint8_t*>(points.data()), points.size()}, 2};
  std::vector<std::uint8_t> bytes;
  encode(Serialisation::cdr, message, bytes);
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), expected.bytes());
}

TEST(Messages, HaveTheDefinitionsOfRos) {
  const std::string rule(80, '=');
  EXPECT_EQ(topic_of("/a", WrittenMessage::custom_driver2, Serialisation::cdr).stored.definition,
            "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\n"
            "uint8[3] rsvd\nlivox_ros_driver2/CustomPoint[] points\n" +
                rule + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" +
                rule + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" + rule +
                "\nMSG: livox_ros_driver2/CustomPoint\nuint32 offset_time\nfloat32 x\nfloat32 y\n"
                "float32 z\nuint8 reflectivity\nuint8 tag\nuint8 line\n");
  EXPECT_EQ(topic_of("/a", WrittenMessage::custom_driver, Serialisation::cdr).type,
            "livox_interfaces/msg/CustomMsg");
  EXPECT_EQ(topic_of("/a", WrittenMessage::custom_driver, Serialisation::ros1).type,
            "livox_ros_driver/CustomMsg");
}

TEST(PointPlaces, FindAndChangeCoordinates) {
  std::vector<std::uint8_t> data(2 * 40 + 8), bytes;
  PointCloud2 cloud;
  cloud.height = 2;
  cloud.width = 1;
  cloud.fields = {{"Z", 24, kFloat64Field}, {"x", 8, kFloat64Field}, {"y", 16, kFloat64Field}};
  cloud.point_step = 40;
  cloud.row_step = 44;
  cloud.data = data;
  for (const bool big_endian : {false, true}) {
    cloud.big_endian = big_endian;
    for (const Serialisation serialisation : {Serialisation::ros1, Serialisation::cdr}) {
      encode(serialisation, cloud, bytes);
      const PointPlaces places = point_places(MessageKind::cloud, serialisation, bytes);
      ASSERT_EQ(places.count, 2U);
      store_point(places, 1, {1.25, -2, 1e-3}, bytes);
      EXPECT_THAT(load_point(places, 1, bytes), ElementsAre(1.25, -2, 1e-3));
      EXPECT_THAT(load_point(places, 0, bytes), ElementsAre(0, 0, 0));
      EXPECT_EQ(places.place(1) - places.place(0), 44U);
    }
  }
  cloud.fields[0].datatype = kFloat32Field;
  encode(Serialisation::cdr, cloud, bytes);
  EXPECT_THROW(point_places(MessageKind::cloud, Serialisation::cdr, bytes), BadMessage);
}

TEST(PointPlaces, FindAndChangeCoordinatesOfCustomMessages) {
  for (const bool big_endian : {false, true}) {
    written::Cdr message(big_endian);
    message.header(5, "abc").put<std::uint64_t>(77).put<std::uint32_t>(2).put<std::uint8_t>(4);
    for (int i = 0; i < 3; ++i) message.put<std::uint8_t>(0);
    message.put<std::uint32_t>(2);
    for (const float x : {1.5F, 2.5F}) {
      message.put<std::uint32_t>(7).put<float>(x).put<float>(-2).put<float>(0.25F);
      for (int i = 0; i < 3; ++i) message.put<std::uint8_t>(0);
    }
    std::vector<std::uint8_t> bytes(message.bytes().begin(), message.bytes().end());
    const PointPlaces places = point_places(MessageKind::points, Serialisation::cdr, bytes);
    ASSERT_EQ(places.count, 2U);
    EXPECT_EQ(places.lidar_id, 4);
    EXPECT_THAT(load_point(places, 1, bytes), ElementsAre(2.5, -2, 0.25));
    store_point(places, 1, {1.25, -3, 8}, bytes);
    CustomMessage changed;
    decode(Serialisation::cdr, bytes, changed);
    EXPECT_EQ(changed.points[0].x, 1.5F);
    EXPECT_EQ(changed.points[1].x, 1.25F);
    EXPECT_EQ(changed.points[1].z, 8.0F);
  }
}

}  // namespace risley::bags::bag_writer_test
