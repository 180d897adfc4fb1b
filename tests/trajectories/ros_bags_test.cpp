// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/bags/bag.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "bags/written_bags.hpp"
#include "bags/written_mcap.hpp"
#include "io/test_folder.hpp"
#include "refusal.hpp"
#include "trajectories/known_flight.hpp"
#include "warning_codes.hpp"

namespace risley::trajectories::ros_bags_test {

using namespace bags::written;
using bags::BagKind;
using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr std::int64_t kBegin_ns = 1'600'000'000'123'456'789;  // 2020

enum class Type { odometry, pose, pose_with_covariance, transform, twist };

struct TypeNames {
  const char *ros1, *md5, *ros2;
};

TypeNames names_of(Type type) {
  switch (type) {
    case Type::odometry:
      return {"nav_msgs/Odometry", "cd5e73d190d741a2f92e81eda573aca7", "nav_msgs/msg/Odometry"};
    case Type::pose:
      return {"geometry_msgs/PoseStamped", "d3812c3cbc69362b77dc0b19b345f8f5",
              "geometry_msgs/msg/PoseStamped"};
    case Type::pose_with_covariance:
      return {"geometry_msgs/PoseWithCovarianceStamped", "953b798c0f514ff060a53a3498ce6246",
              "geometry_msgs/msg/PoseWithCovarianceStamped"};
    case Type::transform:
      return {"geometry_msgs/TransformStamped", "b5764a33bfeb3588febc2682852579b0",
              "geometry_msgs/msg/TransformStamped"};
    case Type::twist:
      return {"geometry_msgs/Twist", "9f195f881246fdfa2798d1d3eebca84a", "geometry_msgs/msg/Twist"};
  }
  return {};
}

/// A message as a test wants it.
struct Sample {
  std::int64_t time_ns = 0;
  std::string frame = "odom", body = "base_link";
  std::array<double, 3> position{};
  std::array<double, 4> xyzw{0, 0, 0, 1};
  std::array<double, 36> covariance{};
  std::array<double, 3> twist{};
};

/// The fields of a message, which both serialisations have in the same order.
template <class Number, class Text>
void put_fields(Type type, const Sample& s, Number&& number, Text&& text) {
  if (type == Type::odometry || type == Type::transform) text(s.body);
  for (const double value : s.position) number(value);
  for (const double value : s.xyzw) number(value);
  if (type == Type::odometry || type == Type::pose_with_covariance) {
    for (const double value : s.covariance) number(value);
  }
  if (type != Type::odometry) return;
  for (const double value : s.twist) number(value);
  for (int i = 0; i < 39; ++i) number(0.25);
}

std::string ros1_bytes(Type type, const Sample& s) {
  std::string bytes = ros_header(static_cast<std::uint64_t>(s.time_ns), s.frame);
  put_fields(
      type, s, [&](double value) { put<double>(bytes, value); },
      [&](const std::string& value) { put_text(bytes, value); });
  return bytes;
}

std::string ros2_bytes(Type type, const Sample& s, bool big_endian = false) {
  Cdr cdr(big_endian);
  cdr.header(static_cast<std::uint64_t>(s.time_ns), s.frame);
  put_fields(
      type, s, [&](double value) { cdr.put<double>(value); },
      [&](const std::string& value) { cdr.text(value); });
  return cdr.bytes();
}

struct TopicOfSamples {
  std::string name;
  Type type;
  std::vector<Sample> samples;
};

const io::TestFolder& folder() {
  static const io::TestFolder one;
  return one;
}

RawMessage raw(Type type, std::string bytes) {
  return {names_of(type).ros1, names_of(type).md5, "any definition", std::move(bytes)};
}

std::string write(BagKind kind, const std::vector<TopicOfSamples>& topics) {
  if (kind == BagKind::ros1) {
    Ros1BagFile bag;
    for (const TopicOfSamples& topic : topics) {
      for (const Sample& s : topic.samples) {
        bag.add(topic.name, raw(topic.type, ros1_bytes(topic.type, s)));
      }
    }
    const std::string path = folder().file("poses.bag");
    bag.write(path);
    return path;
  }
  Ros2BagFile bag;
  for (const TopicOfSamples& topic : topics) {
    const std::size_t id = bag.topic(topic.name, names_of(topic.type).ros2);
    for (const Sample& s : topic.samples) bag.add(id, ros2_bytes(topic.type, s));
  }
  if (kind == BagKind::mcap) {
    const std::string path = folder().file("poses.mcap");
    McapFile(bag).write(path);
    return path;
  }
  const std::string path = folder().file("poses.db3");
  std::remove(path.c_str());
  bag.write(path).reset();
  return path;
}

/// What reading says is wrong, "" when nothing is.
std::string fault(const std::string& path, const std::string& topic = {}) {
  return refusal<Error>([&] { require_trajectory(load_trajectory(path, {}, topic)); });
}

std::string fault(BagKind kind, const std::vector<Sample>& samples, Type type = Type::odometry) {
  return fault(write(kind, {{"/odom", type, samples}}));
}

/// Poses of the known flight in its local frame: x east, y north, z up, at 100 Hz.
std::vector<Sample> samples(int count) {
  const KnownFlight flight;
  const Eigen::Matrix3d ned = geocentric_from_ned(flight.place(0));
  const Vector3d begin = flight.position(0);
  Eigen::Matrix3d enu_from_ned;
  enu_from_ned << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  const Eigen::Matrix3d turn = enu_from_ned * ned.transpose();
  std::vector<Sample> all;
  for (int i = 0; i < count; ++i) {
    const double t = 0.01 * i;
    Sample s;
    s.time_ns = kBegin_ns + i * 10'000'000LL;
    const Vector3d position = turn * (flight.position(t) - begin);
    const Eigen::Matrix3d body =
        Eigen::Quaterniond(turn * flight.attitude(t).toRotationMatrix()).toRotationMatrix();
    Eigen::Matrix3d left_up = body;  // columns: forward, left, up
    left_up.col(1) *= -1;
    left_up.col(2) *= -1;
    const Eigen::Quaterniond q(left_up);
    const Vector3d twist = left_up.transpose() * turn * flight.velocity(t);
    for (int k = 0; k < 3; ++k) {
      s.position[k] = position[k];
      s.twist[k] = twist[k];
    }
    s.xyzw = {q.x(), q.y(), q.z(), q.w()};
    all.push_back(s);
  }
  return all;
}

constexpr std::array kKinds{BagKind::ros1, BagKind::ros2, BagKind::mcap};

TEST(RosBags, OdometryIsPosesAndVelocities) {
  for (const BagKind kind : kKinds) {
    const std::vector<Sample> flown = samples(300);
    const std::string path = write(kind, {{"/odom", Type::odometry, flown}});
    EXPECT_EQ(trajectory_file_kind(path), TrajectoryFileKind::trajectory);
    const Trajectory t = load_trajectory(path);
    require_trajectory(t);
    ASSERT_EQ(t.size(), flown.size());
    EXPECT_EQ(t.format, bags::name_of(kind));
    EXPECT_THAT(t.source, AllOf(NamesField("topic /odom"), NamesField("Odometry"),
                                NamesField("\"odom\""), NamesField("\"base_link\"")));
    EXPECT_EQ(t.frame, Frame::local);
    EXPECT_EQ(t.time_scale, TimeScale::utc_unix);
    EXPECT_TRUE(t.accuracy.empty());  // zeros state nothing
    EXPECT_THAT(t.warnings, IsEmpty());
    ASSERT_EQ(t.velocity.size(), t.size());
    EXPECT_EQ(t.velocity_frame->name, "forward-left-up of the body");
    const KnownFlight flight;
    for (std::size_t i = 0; i < t.size(); ++i) {
      EXPECT_EQ(t.time_ns[i], flown[i].time_ns);
      const RollPitchHeading angles = roll_pitch_heading(t.frame, t.position[i], t.attitude[i]);
      // Over 60 m the vertical turns by 1e-5.
      const RollPitchHeading wanted = flight.angles(0.01 * static_cast<double>(i));
      EXPECT_NEAR(angles.roll, wanted.roll, 3e-5);
      EXPECT_NEAR(angles.pitch, wanted.pitch, 3e-5);
      EXPECT_NEAR(std::remainder(angles.heading - wanted.heading, kTwoPi), 0, 3e-5);
    }
    const std::size_t middle = t.size() / 2;
    const Vector3d moved = (t.position[middle + 1] - t.position[middle - 1]) / 0.02;
    EXPECT_LT((moved - t.velocity[middle]).norm(), 1e-3);
  }
}

TEST(RosBags, AQuarterTurnToTheLeftIsHeadingNorth) {
  Sample s;
  s.time_ns = kBegin_ns;
  s.xyzw = {0, 0, std::sqrt(0.5), std::sqrt(0.5)};  // x of the body along y of the map
  for (const BagKind kind : kKinds) {
    const Trajectory t = load_trajectory(write(kind, {{"/pose", Type::pose, {s}}}));
    const RollPitchHeading angles = roll_pitch_heading(t.frame, t.position[0], t.attitude[0]);
    EXPECT_NEAR(std::remainder(angles.heading, kTwoPi), 0, 1e-15);
    EXPECT_NEAR(angles.roll, 0, 1e-15);
    EXPECT_NEAR(angles.pitch, 0, 1e-15);
  }
  s.xyzw = {0, std::sin(-0.05), 0, std::cos(-0.05)};  // about the left axis, nose up
  const Trajectory t = load_trajectory(write(BagKind::ros1, {{"/pose", Type::pose, {s}}}));
  const RollPitchHeading angles = roll_pitch_heading(t.frame, t.position[0], t.attitude[0]);
  EXPECT_NEAR(angles.pitch, 0.1, 1e-15);
  EXPECT_NEAR(angles.heading, kPi / 2, 1e-15);
}

TEST(RosBags, EveryTypeAndByteOrderGivesTheSamePoses) {
  const std::vector<Sample> flown = samples(20);
  const Trajectory wanted = load_trajectory(write(BagKind::ros1, {{"/a", Type::odometry, flown}}));
  for (const BagKind kind : kKinds) {
    for (const Type type : {Type::pose, Type::pose_with_covariance, Type::transform}) {
      const Trajectory t = load_trajectory(write(kind, {{"/a", type, flown}}));
      EXPECT_EQ(t.time_ns, wanted.time_ns);
      EXPECT_TRUE(t.velocity.empty());
      EXPECT_EQ(t.velocity_frame->name, "none");
      for (std::size_t i = 0; i < t.size(); ++i) {
        EXPECT_EQ(t.position[i], wanted.position[i]);
        EXPECT_EQ(t.attitude[i].coeffs(), wanted.attitude[i].coeffs());
      }
    }
  }
  Ros2BagFile bag;
  const std::size_t id = bag.topic("/a", "nav_msgs/msg/Odometry");
  for (const Sample& s : flown) bag.add(id, ros2_bytes(Type::odometry, s, true));
  const std::string path = folder().file("big_endian.db3");
  bag.write(path).reset();
  const Trajectory t = load_trajectory(path);
  ASSERT_EQ(t.size(), wanted.size());
  for (std::size_t i = 0; i < t.size(); ++i) EXPECT_EQ(t.position[i], wanted.position[i]);
}

TEST(RosBags, CovariancesBecomeAccuracies) {
  std::vector<Sample> flown = samples(12);
  for (Sample& s : flown) {
    const double half = 0.5 * radians_from_degrees(60);  // heading 30 degrees
    s.xyzw = {0, 0, std::sin(half), std::cos(half)};
    s.covariance[0] = 0.04;                            // x: east
    s.covariance[7] = 0.01;                            // y: north
    s.covariance[14] = 0.09;                           // z
    s.covariance[21] = 4e-6, s.covariance[28] = 1e-6;  // about east and north
    s.covariance[22] = s.covariance[27] = 5e-7;
    s.covariance[35] = 9e-6;
  }
  for (const Type type : {Type::odometry, Type::pose_with_covariance}) {
    const Trajectory t = load_trajectory(write(BagKind::ros2, {{"/a", type, flown}}));
    ASSERT_EQ(t.accuracy.size(), flown.size());
    const PoseAccuracy& a = t.accuracy[3];
    EXPECT_NEAR(a.position.x(), 0.1, 1e-12);
    EXPECT_NEAR(a.position.y(), 0.2, 1e-12);
    EXPECT_NEAR(a.position.z(), 0.3, 1e-12);
    // Roll is about the nose, at east sin 30 + north cos 30; pitch about the right wing.
    const double e = 0.5, n = std::sqrt(0.75);
    EXPECT_NEAR(a.roll, std::sqrt(e * e * 4e-6 + n * n * 1e-6 + 2 * e * n * 5e-7), 1e-12);
    EXPECT_NEAR(a.pitch, std::sqrt(n * n * 4e-6 + e * e * 1e-6 - 2 * e * n * 5e-7), 1e-12);
    EXPECT_NEAR(a.heading, 3e-3, 1e-12);
  }
}

TEST(RosBags, WhatStatesNoAccuracyStatesNone) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::array<std::function<void(Sample&)>, 6> ways{
      [](Sample& s) { s.covariance.fill(0); },
      [](Sample& s) { s.covariance.fill(-1); },
      [](Sample& s) { s.covariance[0] = -1; },
      [=](Sample& s) { s.covariance[21] = kNan; },
      [](Sample& s) { s.covariance[35] = 1e6; },                       // "unknown"
      [](Sample& s) { s.covariance[22] = s.covariance[27] = 9e-6; }};  // no covariance at all
  for (const auto& way : ways) {
    std::vector<Sample> flown = samples(12);
    for (Sample& s : flown) {
      for (std::size_t i = 0; i < 6; ++i) s.covariance[7 * i] = i < 3 ? 0.01 : 1e-6;
    }
    ASSERT_EQ(load_trajectory(write(BagKind::ros1, {{"/a", Type::pose_with_covariance, flown}}))
                  .accuracy.size(),
              12U);
    way(flown[4]);
    const double half = -0.5 * radians_from_degrees(135);
    flown[4].xyzw = {0, 0, std::sin(half), std::cos(half)};
    const Trajectory t =
        load_trajectory(write(BagKind::ros1, {{"/a", Type::pose_with_covariance, flown}}));
    EXPECT_TRUE(t.accuracy.empty());
    EXPECT_THAT(t.warnings,
                ElementsAre(Warns(kWarning.columns_unused, {"1 of 12 messages", "/a"})));
  }
}

TEST(RosBags, VelocitiesInOtherAxesAndNoneAreTold) {
  std::vector<Sample> flown = samples(300);
  for (std::size_t i = 0; i + 1 < flown.size(); ++i) {  // along the map, as many write them
    for (std::size_t k = 0; k < 3; ++k) {
      flown[i].twist[k] = (flown[i + 1].position[k] - flown[i].position[k]) / 0.01;
    }
  }
  const Trajectory turned = load_trajectory(write(BagKind::ros1, {{"/a", Type::odometry, flown}}));
  EXPECT_THAT(turned.warnings,
              ElementsAre(Warns(kWarning.velocity_frame, {"forward-left-up", "east-north-up"})));
  for (Sample& s : flown) s.twist = {0, 0, 0};
  const Trajectory none = load_trajectory(write(BagKind::ros1, {{"/a", Type::odometry, flown}}));
  EXPECT_TRUE(none.velocity.empty());
  flown[7].twist[1] = std::numeric_limits<double>::quiet_NaN();
  const Trajectory part = load_trajectory(write(BagKind::ros1, {{"/a", Type::odometry, flown}}));
  EXPECT_TRUE(part.velocity.empty());
  EXPECT_THAT(part.warnings,
              ElementsAre(Warns(kWarning.columns_unused, {"1 of 300 messages", "/a"})));
}

TEST(RosBags, OneTopicIsTakenAndOfSeveralOneIsNamed) {
  const std::vector<Sample> flown = samples(12);
  std::vector<Sample> moved = flown;
  for (Sample& s : moved) s.position[2] += 100;
  for (const BagKind kind : kKinds) {
    const std::string path = write(kind, {{"/odom", Type::odometry, flown},
                                          {"/slam/pose", Type::pose, moved},
                                          {"/twist", Type::twist, flown}});
    EXPECT_THROW(load_trajectory(path), InvalidArgument);
    EXPECT_THAT(fault(path), AllOf(NamesField("option trajectory_topic"), NamesField("/odom"),
                                   NamesField("/slam/pose"), Not(NamesField("/twist"))));
    EXPECT_EQ(load_trajectory(path, {}, "/slam/pose").position[0].z(), moved[0].position[2]);
    EXPECT_EQ(load_trajectory(path, {}, "/odom").position[0].z(), flown[0].position[2]);
    for (const char* wrong : {"/twist", "/odo", "odom"}) {
      EXPECT_THROW(load_trajectory(path, {}, wrong), InvalidArgument);
      EXPECT_THAT(fault(path, wrong),
                  AllOf(NamesField(fmt::format("topic = {}", wrong)), NamesField("/odom")));
    }
    const std::string without = write(kind, {{"/twist", Type::twist, flown}});
    EXPECT_EQ(trajectory_file_kind(without), TrajectoryFileKind::none);
    EXPECT_THROW(load_trajectory(without), FileError);
    EXPECT_THAT(fault(without), NamesField("/twist"));
  }
  const std::string csv = folder().file("a.csv");
  write_trajectory(csv, trajectory_of(KnownFlight(), 5));
  EXPECT_THROW(load_trajectory(csv, {}, "/odom"), InvalidArgument);
  EXPECT_THAT(fault(csv, "/odom"), NamesField("a.csv"));
}

TEST(RosBags, ABagWithALidarIsARecordingWhosePosesCanBeRead) {
  const std::vector<Sample> flown = samples(12);
  Ros1BagFile first;
  first.add("/livox/lidar", {"livox_ros_driver/CustomMsg", "e4d6829bdfe657cb6c21a746c86b21a6",
                             "any definition", "not looked at"});
  for (const Sample& s : flown) {
    first.add("/odom", raw(Type::odometry, ros1_bytes(Type::odometry, s)));
  }
  const std::string one = folder().file("lidar.bag");
  first.write(one);
  Ros2BagFile second;
  second.add(second.topic("/livox/lidar", "sensor_msgs/msg/PointCloud2"), "not looked at");
  const std::size_t id = second.topic("/odom", "nav_msgs/msg/Odometry");
  for (const Sample& s : flown) second.add(id, ros2_bytes(Type::odometry, s));
  const std::string two = folder().file("lidar.db3");
  second.write(two).reset();
  for (const std::string& path : {one, two}) {
    EXPECT_EQ(trajectory_file_kind(path), TrajectoryFileKind::none);
    EXPECT_EQ(load_trajectory(path).size(), flown.size());
  }
}

TEST(RosBags, StampsAreNanosecondsOfTheHeader) {
  std::vector<Sample> flown = samples(40);
  for (std::size_t i = 0; i < flown.size(); ++i)
    flown[i].time_ns = kBegin_ns + 7 * static_cast<std::int64_t>(i * i);
  for (const BagKind kind : kKinds) {
    const Trajectory t = load_trajectory(write(kind, {{"/a", Type::pose, flown}}));
    ASSERT_EQ(t.size(), flown.size());
    for (std::size_t i = 0; i < t.size(); ++i) EXPECT_EQ(t.time_ns[i], flown[i].time_ns);
  }
  // Since power-on: a clock that is not stated.
  for (std::size_t i = 0; i < flown.size(); ++i)
    flown[i].time_ns = static_cast<std::int64_t>(i) * 10'000'000;
  const Trajectory t = load_trajectory(write(BagKind::ros1, {{"/a", Type::pose, flown}}));
  EXPECT_EQ(t.time_scale, TimeScale::unknown);
  EXPECT_EQ(t.time_ns[0], 0);
}

TEST(RosBags, TimesThatRunBackAreSortedOrRefused) {
  for (const BagKind kind : kKinds) {
    std::vector<Sample> flown = samples(30);
    std::swap(flown[10], flown[11]);
    const Trajectory t = load_trajectory(write(kind, {{"/a", Type::pose, flown}}));
    EXPECT_EQ(t.size(), 30U);
    EXPECT_EQ(t.time_order.moved, 1U);
    EXPECT_THAT(t.warnings, ElementsAre(Warns(kWarning.rows_sorted, {"1 of 30"})));
    flown[20].time_ns -= 5'000'000'000;
    EXPECT_THAT(fault(kind, flown), AllOf(NamesField("record 21"), Not(NamesField("byte"))));
    flown = samples(5);
    for (Sample& s : flown) s.time_ns = 0;
    EXPECT_THAT(fault(kind, flown), NamesField("time stamp 0"));
  }
}

TEST(RosBags, PosesThatAreNoneAreRefusedWithTheirMessage) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  struct Case {
    std::function<void(Sample&)> change;
    const char* named;
  };
  const std::vector<Case> cases{
      {[=](Sample& s) { s.xyzw[2] = kNan; }, "orientation"},
      {[](Sample& s) {
         s.xyzw = {0, 0, 0, 0};
       },
       "orientation"},
      {[](Sample& s) { s.xyzw[3] = 1.5; }, "orientation"},
      {[=](Sample& s) { s.position[1] = kInf; }, "finite"},
      {[=](Sample& s) { s.position[0] = kNan; }, "finite"},
      {[](Sample& s) { s.frame = "map"; }, "one frame"},
      {[](Sample& s) { s.body = "camera"; }, "one frame"},
  };
  for (const BagKind kind : kKinds) {
    for (const Case& one : cases) {
      std::vector<Sample> flown = samples(9);
      one.change(flown[4]);
      EXPECT_THAT(fault(kind, flown), AllOf(NamesField(one.named), NamesField("5 of topic /odom")));
    }
    std::vector<Sample> flown = samples(9);
    for (Sample& s : flown) s.frame = "earth";
    EXPECT_THAT(fault(kind, flown), NamesField("frame earth"));
    flown = samples(9);
    flown[4].position[0] = 2e7;
    EXPECT_THAT(fault(kind, flown),
                AllOf(NamesField("record 5"), NamesField("position = 20000000 m")));
  }
}

TEST(RosBags, QuaternionsThatAreNearlyUnitAreMadeSo) {
  std::vector<Sample> flown = samples(9);
  for (Sample& s : flown) {
    for (double& value : s.xyzw) value *= 1.004;
  }
  const Trajectory t = load_trajectory(write(BagKind::ros2, {{"/a", Type::pose, flown}}));
  for (const auto& attitude : t.attitude) EXPECT_NEAR(attitude.norm(), 1, 1e-15);
}

TEST(RosBags, MessagesOfAnotherSizeAreRefused) {
  for (const Type type :
       {Type::odometry, Type::pose, Type::pose_with_covariance, Type::transform}) {
    const Sample s = samples(1)[0];
    const std::string one = ros1_bytes(type, s), two = ros2_bytes(type, s);
    // From 1 on: rosbag's writer, which stands in for a hostile one, must not copy from nowhere.
    for (std::size_t length = 1; length <= one.size() + 8; ++length) {
      const bool between = length > 64 && length + 16 < one.size();
      if (length == one.size() || (between && length % 7 != 0)) continue;
      std::string bytes = one;
      bytes.resize(length);
      Ros1BagFile bag;
      bag.add("/a", raw(type, bytes));
      const std::string path = folder().file("size.bag");
      bag.write(path);
      EXPECT_THROW(load_trajectory(path), FileError) << length;
    }
    for (std::size_t length = 0; length < two.size(); ++length) {
      Ros2BagFile bag;
      bag.add(bag.topic("/a", names_of(type).ros2), two.substr(0, length));
      const std::string path = folder().file("size.db3");
      std::remove(path.c_str());
      bag.write(path).reset();
      EXPECT_THROW(load_trajectory(path), FileError) << length;
      if (type != Type::pose) length += 6;  // each is a database
    }
  }
}

TEST(RosBags, HostileLengthsCostNothing) {
  const Sample s = samples(1)[0];
  for (const std::uint32_t length : {1'000U, 0x7fffffffU, 0xffffffffU}) {
    std::string one = ros1_bytes(Type::odometry, s);
    one.replace(12, 4, reinterpret_cast<const char*>(&length), 4);  // of the frame's name
    Ros1BagFile first;
    first.add("/a", raw(Type::odometry, one));
    const std::string path = folder().file("hostile.bag");
    first.write(path);
    EXPECT_THAT(fault(path), NamesField("frame name"));
    std::string two = ros2_bytes(Type::odometry, s);
    two.replace(12, 4, reinterpret_cast<const char*>(&length), 4);
    Ros2BagFile second;
    second.add(second.topic("/a", "nav_msgs/msg/Odometry"), two);
    const std::string other = folder().file("hostile.db3");
    std::remove(other.c_str());
    second.write(other).reset();
    EXPECT_THAT(fault(other), NamesField("CDR"));
  }
  std::string stamp = ros1_bytes(Type::pose, s);
  const std::uint32_t nanoseconds = 1'000'000'000;
  stamp.replace(8, 4, reinterpret_cast<const char*>(&nanoseconds), 4);
  Ros1BagFile bag;
  bag.add("/a", raw(Type::pose, stamp));
  const std::string path = folder().file("stamp.bag");
  bag.write(path);
  EXPECT_THAT(fault(path), NamesField("1e9 ns"));
}

std::string bytes_of_file(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(RosBags, McapCutAnywhereGivesThePosesBeforeTheCut) {
  const std::string whole = bytes_of_file(write(BagKind::mcap, {{"/a", Type::pose, samples(9)}}));
  const std::string path = folder().file("cut.mcap");
  std::size_t most = 0;
  for (std::size_t length = 0; length < whole.size(); length += 3) {
    write_bytes(path, whole.substr(0, length));
    try {
      const Trajectory part = load_trajectory(path);
      EXPECT_GE(part.size(), most) << length;
      most = part.size();
      ASSERT_FALSE(part.warnings.empty());
      EXPECT_THAT(part.warnings.front(), Warns(kWarning.cut_off));
    } catch (const FileError&) {
      EXPECT_EQ(most, 0U) << length;
    }
  }
  EXPECT_EQ(most, 9U);
}

TEST(RosBags, AFolderOfRos2IsOneTrajectory) {
  const std::string bag = folder().file("folder");
  std::filesystem::create_directories(bag);
  std::vector<Sample> flown = samples(20);
  for (const auto& [name, first] : {std::pair{"0.mcap", 0}, {"1.mcap", 10}}) {
    std::filesystem::copy_file(
        write(BagKind::mcap,
              {{"/a", Type::pose, {flown.begin() + first, flown.begin() + first + 10}}}),
        bag + "/" + name, std::filesystem::copy_options::overwrite_existing);
  }
  EXPECT_THAT(fault(bag), NamesField("metadata.yaml"));
  write_bytes(bag + "/metadata.yaml",
              "rosbag2_bagfile_information: {version: 6, relative_file_paths: [0.mcap, 1.mcap]}");
  EXPECT_EQ(load_trajectory(bag).size(), 20U);
  EXPECT_EQ(trajectory_file_kind(bag), TrajectoryFileKind::trajectory);
}

TEST(RosBags, OtherBagsCutAnywhereAreRefused) {
  for (const BagKind kind : {BagKind::ros1, BagKind::ros2}) {
    const std::string whole = bytes_of_file(write(kind, {{"/a", Type::pose, samples(3)}}));
    const std::string path = folder().file("cut");
    for (std::size_t length = 0; length < whole.size(); ++length) {
      write_bytes(path, whole.substr(0, length));
      EXPECT_THROW(load_trajectory(path), FileError) << length;
    }
    write_bytes(path, whole);
    EXPECT_EQ(load_trajectory(path).size(), 3U);
  }
}

TEST(RosBags, DamagedBytesNeverGiveAnUnsoundTrajectory) {
  for (const BagKind kind : kKinds) {
    const std::string whole = bytes_of_file(write(kind, {{"/a", Type::odometry, samples(3)}}));
    const std::string path = folder().file("damaged");
    std::uint64_t state = 12345;
    for (int i = 0; i < 600; ++i) {
      std::string bytes = whole;
      for (int k = 0; k < 2; ++k) {
        state = state * 6364136223846793005ULL + 1442695040888963407ULL;
        bytes[(state >> 33U) % bytes.size()] = static_cast<char>(state >> 20U);
      }
      write_bytes(path, bytes);
      try {
        require_trajectory(load_trajectory(path));
      } catch (const FileError&) {
        continue;
      }
    }
  }
}

TEST(RosBags, ATopicWithoutMessagesIsRefused) {
  Ros2BagFile bag;
  bag.topic("/a", "nav_msgs/msg/Odometry");
  const std::string path = folder().file("empty.db3");
  bag.write(path).reset();
  EXPECT_THAT(fault(path), NamesField("topic /a"));
}

TEST(RosBags, AnUnknownMd5IsNamed) {
  Ros1BagFile bag;
  RawMessage message = raw(Type::odometry, ros1_bytes(Type::odometry, samples(1)[0]));
  message.md5 = "00000000000000000000000000000000";
  bag.add("/odom", message);
  const std::string path = folder().file("md5.bag");
  bag.write(path);
  EXPECT_THAT(fault(path), AllOf(NamesField("nav_msgs/Odometry"), HasSubstr("md5 0000")));
  EXPECT_EQ(trajectory_file_kind(path), TrajectoryFileKind::none);
}

}  // namespace risley::trajectories::ros_bags_test
