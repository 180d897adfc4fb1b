// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Recordings written as bags, and read again.
#include <cmath>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/bags/bag.hpp"
#include "risley/core/error.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/writer.hpp"

#include "io/test_folder.hpp"

namespace risley::recordings::bag_recording_test {

using io::TestFolder;
using ::testing::IsEmpty;

constexpr std::int64_t kBegin = 1'700'000'000'000'000'123;

/// Shots of one sensor: every eleventh without a return, in whole millimetres.
Recording sample(std::uint8_t type, std::int64_t begin_ns, std::size_t rows, bool inertia) {
  Recording recording;
  recording.header.format = "test";
  recording.header.devices = {Device{}};
  recording.header.devices.front().type = type;
  recording.header.time_reference = TimeReference::utc;
  Observations& o = recording.data.observations;
  o.resize(rows);
  for (std::size_t i = 0; i < rows; ++i) {
    o.time_ns[i] = begin_ns + static_cast<std::int64_t>(i) * 10'000;
    const double x = 1e-3 * static_cast<double>(4000 + i % 777),
                 y = 1e-3 * static_cast<double>(i % 501), z = -1e-3 * static_cast<double>(i % 303);
    const bool hit = i % 11 != 0;
    o.range[i] = hit ? std::hypot(x, y, z) : 0;
    o.azimuth[i] = std::atan2(y, x);
    o.zenith[i] = std::atan2(std::hypot(x, y), z);
    o.intensity[i] = static_cast<std::uint8_t>(i);
    o.return_number[i] = 1;
    o.tag[i] = static_cast<std::uint8_t>(i % 3);
    o.beam[i] = 0;
    o.device[i] = 0;
    o.valid[i] = hit ? 1 : 0;
  }
  if (inertia) {
    for (int i = 0; i < 20; ++i) {
      recording.data.imu.push_back(
          {begin_ns + i * 5'000'000, 0, {0.1F, 0.2F, 0.3F}, {0.0F, 0.01F, 1.0F}});
    }
  }
  return recording;
}

void write(const Recording& recording, const std::string& path, const WriteOptions& options = {}) {
  const auto writer = create_recording(path, recording.header, {}, options);
  writer->write(recording.data);
  writer->close();
}

class BagRecordings
    : public ::testing::TestWithParam<std::tuple<const char*, bags::WrittenMessage>> {};

INSTANTIATE_TEST_SUITE_P(
    Kinds, BagRecordings,
    ::testing::Combine(::testing::Values("out.bag", "out.db3", "out.mcap"),
                       ::testing::Values(bags::WrittenMessage::cloud,
                                         bags::WrittenMessage::custom_driver,
                                         bags::WrittenMessage::custom_driver2)));

TEST_P(BagRecordings, HoldEveryRowAndSample) {
  const TestFolder folder;
  const Recording recording = sample(kMid70, kBegin, 25'000, true);
  const std::string path = folder.file(std::get<0>(GetParam()));
  WriteOptions options;
  options.messages.message = std::get<1>(GetParam());
  options.messages.frame_rate = 20;
  write(recording, path, options);
  const Recording found = load_recording(path);
  EXPECT_THAT(found.warnings, IsEmpty());
  EXPECT_EQ(found.header.devices.front().topic, "/livox/lidar");
  const Observations &a = recording.data.observations, &b = found.data.observations;
  ASSERT_EQ(b.size(), a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(b.time_ns[i], a.time_ns[i]);
    ASSERT_EQ(b.intensity[i], a.intensity[i]);
    ASSERT_EQ(b.tag[i], a.tag[i]);
    ASSERT_EQ(b.beam[i], a.beam[i]);
    ASSERT_EQ(b.valid[i], a.valid[i]);
    ASSERT_NEAR(b.range[i], a.range[i], 1e-6);
    if (a.valid[i] == 0) continue;
    ASSERT_NEAR(b.azimuth[i], a.azimuth[i], 1e-7);
    ASSERT_NEAR(b.zenith[i], a.zenith[i], 1e-7);
  }
  ASSERT_EQ(found.data.imu.size(), recording.data.imu.size());
  for (std::size_t i = 0; i < found.data.imu.size(); ++i) {
    EXPECT_EQ(found.data.imu[i].time_ns, recording.data.imu[i].time_ns);
    EXPECT_EQ(found.data.imu[i].angular_velocity, recording.data.imu[i].angular_velocity);
    EXPECT_EQ(found.data.imu[i].acceleration_g, recording.data.imu[i].acceleration_g);
  }
  const auto bag = bags::open_bag(path);
  bag->rewind(std::vector<bool>(bag->topics().size(), true));
  std::size_t messages = 0;
  for (bags::Message message; bag->next(message);) {
    messages += bag->topics()[message.topic].name == "/livox/lidar" ? 1 : 0;
  }
  EXPECT_EQ(messages, 5U);  // 0.25 s at 20 Hz
}

TEST(BagRecording, NamesTopicsOfSeveralSensorsAsDriversDo) {
  const TestFolder folder;
  Recording recording = sample(kMid360, kBegin, 2000, false);
  Device other = recording.header.devices.front();
  recording.header.devices.front().serial = "3JEDHB300100641";
  other.address = "192.168.1.112";
  other.index = 1;
  recording.header.devices.push_back(other);
  for (std::size_t i = 0; i < 2000; ++i) {
    recording.data.observations.device[i] = static_cast<std::uint8_t>(i % 2);
  }
  write(recording, folder.file("two.mcap"));
  const auto reader = open_recording(folder.file("two.mcap"));
  ASSERT_EQ(reader->header().devices.size(), 2U);
  // Topics come in the order of their names.
  EXPECT_EQ(reader->header().devices[0].address, "192.168.1.112");
  EXPECT_EQ(reader->header().devices[1].serial, "3JEDHB300100641");
  for (const bags::Topic& topic : bags::list_topics(folder.file("two.mcap"))) {
    EXPECT_EQ(topic.type, "livox_ros_driver2/msg/CustomMsg");
  }
}

TEST(BagRecording, RefusesWhatBagsDoNotHold) {
  const TestFolder folder;
  Recording recording = sample(kMid40, kBegin, 10, false);
  recording.header.has_range = false;
  EXPECT_THROW(create_recording(folder.file("a.mcap"), recording.header), InvalidArgument);
  recording.header.has_range = true;
  WriteOptions options;
  options.messages.frame_rate = 0.1;  // offsets of 32 bits would not reach
  EXPECT_THROW(create_recording(folder.file("a.mcap"), recording.header, {}, options),
               InvalidArgument);
  // ROS 2's seconds end in 2038, those of ROS 1 in 2106.
  recording.data.observations.time_ns.back() = 2'147'483'648'000'000'000;
  EXPECT_THROW(write(recording, folder.file("a.mcap")), InvalidArgument);
  write(recording, folder.file("a.bag"));
}

}  // namespace risley::recordings::bag_recording_test
