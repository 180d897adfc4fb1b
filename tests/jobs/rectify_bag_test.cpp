// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The topic of a lidar is replaced by the same points where the calibration sends their beams, and
// nothing else of its bag changes.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/bags/bag_writer.hpp"
#include "risley/bags/messages.hpp"
#include "risley/core/error.hpp"
#include "risley/jobs/cloud_of_recording.hpp"
#include "risley/recordings/writer.hpp"
#include "risley/scenes/scene.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/truth_file.hpp"

#include "io/test_folder.hpp"
#include "source_tree.hpp"

namespace risley::jobs::rectify_bag_test {

using bags::BagKind;
using bags::WrittenMessage;

constexpr const char* kLidar = "/livox/lidar";

/// Messages of a bag, as they stand in it.
struct Kept {
  std::string topic;
  std::vector<std::uint8_t> bytes;
  std::uint64_t time_ns = 0;
};

std::vector<Kept> messages_of(const std::string& path) {
  const auto bag = bags::open_bag(path);
  bag->rewind(std::vector<bool>(bag->topics().size(), true));
  std::vector<Kept> all;
  for (bags::Message message; bag->next(message);) {
    all.push_back({bag->topics()[message.topic].name,
                   {message.bytes.begin(), message.bytes.end()},
                   message.time_ns});
  }
  return all;
}

/// Keeps points by their rows.
class Collector final : public cloud::CloudWriter {
 public:
  explicit Collector(std::map<std::int64_t, std::array<double, 3>>& points) : points_(points) {}
  void write(const cloud::Points& points) override {
    for (std::size_t i = 0; i < points.size(); ++i) {
      points_[points.row[i]] = {points.x[i], points.y[i], points.z[i]};
    }
  }
  void close() override {}

 private:
  std::map<std::int64_t, std::array<double, 3>>& points_;
};

struct Case {
  BagKind kind;
  WrittenMessage message;
  const char *name, *output;
};

class RectifyBag : public ::testing::TestWithParam<Case> {
 protected:
  /// A scan of a hall by a sensor that believes that it has no errors, with messages of others in
  /// between; a camera's are longer than a chunk.
  void simulate(const std::string& path) {
    simulation::SimulationSettings settings;
    settings.truth = sensors::load_sensor("mid-40-table3");
    settings.reported = settings.truth;
    settings.reported->train = settings.truth.train.without_errors();
    settings.scene = scenes::load_scene(in_source_tree("data/hall.yaml"));
    settings.duration = 1.5;
    settings.rate = 20'000;
    settings.seed = 4;
    settings.writing.messages.message = GetParam().message;
    const std::string plain = folder_.file("plain" + std::string(GetParam().name));
    simulation::simulate_to_file(settings, plain, {});
    truth_ = plain + ".truth.yaml";
    const auto from = bags::open_bag(plain);
    const auto to = bags::create_bag(path, GetParam().kind);
    const bags::Serialisation serialisation = bags::serialisation_of(GetParam().kind);
    const std::size_t lidar = to->add(from->topics().front());
    bags::Topic camera = bags::topic_of("/camera", WrittenMessage::imu, serialisation);
    camera.stored.type = "sensor_msgs/CompressedImage";
    const std::size_t image = to->add(camera);
    const std::size_t imu =
        to->add(bags::topic_of("/livox/imu", WrittenMessage::imu, serialisation));
    from->rewind({true});
    std::vector<std::uint8_t> picture(1'500'000), sample;
    bags::encode(serialisation, bags::ImuMessage{}, sample);
    for (bags::Message message; from->next(message);) {
      picture[message.time_ns % picture.size()] += 1;
      bags::Message other = message;
      other.bytes = picture;
      to->write(image, other);
      to->write(lidar, message);
      for (int i = 1; i < 20; ++i) {
        other.bytes = sample;
        other.time_ns = other.publish_time_ns = message.time_ns + i * 5'000'000ULL;
        to->write(imu, other);
      }
    }
    to->close();
  }

  io::TestFolder folder_;
  std::string truth_;
};

INSTANTIATE_TEST_SUITE_P(
    Kinds, RectifyBag,
    ::testing::Values(Case{BagKind::mcap, WrittenMessage::custom_driver, "a.mcap", "b.mcap"},
                      Case{BagKind::mcap, WrittenMessage::cloud, "a.mcap", "b.db3"},
                      Case{BagKind::ros2, WrittenMessage::custom_driver2, "a.db3", "b.mcap"},
                      Case{BagKind::ros1, WrittenMessage::custom_driver, "a.bag", "b.bag"},
                      Case{BagKind::ros1, WrittenMessage::cloud, "a.bag", "b.mcap"}));

TEST_P(RectifyBag, ChangesCoordinatesOfTheLidarAlone) {
  const std::string path = folder_.file(GetParam().name);
  simulate(path);
  CloudOfRecordingOptions options;
  options.recording = path;
  options.calibration = truth_;
  options.output = folder_.file(GetParam().output);
  options.replace = true;
  const RecordingCloud made = cloud_of_recording(options);
  EXPECT_GT(made.summary.repointing_rms, 1e-4);  // which is what a calibration is for

  std::map<std::int64_t, std::array<double, 3>> points;
  options.cloud.rows = true;
  PointsOfRecording all(
      options, [&](const cloud::CloudHeader&) { return std::make_unique<Collector>(points); }, {});
  while (all.next()) {
  }
  EXPECT_EQ(points.size(), made.summary.points);
  ASSERT_GT(points.size(), 20'000U);

  std::vector<Kept> before = messages_of(path), after = messages_of(options.output);
  if (GetParam().kind == BagKind::ros1) {  // rosbag gives messages of equal times in no order
    for (auto* kept : {&before, &after}) {
      std::ranges::sort(*kept, {},
                        [](const Kept& one) { return std::tie(one.time_ns, one.topic); });
    }
  }
  ASSERT_EQ(after.size(), before.size());
  const bags::MessageKind kind = GetParam().message == WrittenMessage::cloud
                                     ? bags::MessageKind::cloud
                                     : bags::MessageKind::points;
  const bags::Serialisation serialisation = bags::serialisation_of(GetParam().kind);
  std::int64_t row = 0;
  std::size_t moved = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    ASSERT_EQ(after[i].topic, before[i].topic) << i;
    ASSERT_EQ(after[i].time_ns, before[i].time_ns) << i;
    if (before[i].topic != kLidar) {
      ASSERT_TRUE(after[i].bytes == before[i].bytes) << i;
      continue;
    }
    std::vector<std::uint8_t> restored = after[i].bytes;
    const bags::PointPlaces places = bags::point_places(kind, serialisation, restored);
    for (std::size_t point = 0; point < places.count; ++point, ++row) {
      const auto old = bags::load_point(places, point, before[i].bytes);
      const auto found = bags::load_point(places, point, after[i].bytes);
      const auto expected = points.find(row);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double wanted = expected == points.end() ? 0.0 : expected->second[axis];
        ASSERT_EQ(found[axis], static_cast<float>(wanted)) << row;
      }
      moved += found != old ? 1 : 0;
      bags::store_point(places, point, old, restored);
    }
    ASSERT_TRUE(restored == before[i].bytes) << i;
  }
  EXPECT_EQ(row, 30'000);
  EXPECT_GT(moved, 20'000U);
}

TEST(RectifyBagRefusals, NameWhatCannotBeReplaced) {
  const io::TestFolder folder;
  CloudOfRecordingOptions options;
  options.recording = in_source_tree("data/hall.yaml");
  options.calibration = "mid-40";
  options.replace = true;
  options.output = folder.file("a.las");
  EXPECT_THROW(cloud_of_recording(options), InvalidArgument);
  options.output = folder.file("a.mcap");
  options.reading.extrinsics.emplace();
  EXPECT_THROW(cloud_of_recording(options), InvalidArgument);
}

}  // namespace risley::jobs::rectify_bag_test
