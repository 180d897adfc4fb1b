// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Poses of bags of ROS 1 and ROS 2. Frames of ROS have x east, y north and z up if they are maps,
// bodies x forward, y left and z up (REP 103); twists are in the body's axes.
#include "trajectories/formats/ros_bag.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "risley/bags/bag.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"

#include "trajectories/formats/format.hpp"
#include "trajectories/formats/pose_rows.hpp"
#include "trajectories/formats/ros_pose.hpp"

namespace risley::trajectories {
namespace {

bool is_pose_topic(const bags::Topic& topic) { return topic.kind && holds_pose(*topic.kind); }

bool is_lidar_topic(const bags::Topic& topic) {
  return topic.kind == bags::MessageKind::points || topic.kind == bags::MessageKind::cloud;
}

std::vector<bags::Topic> pose_topics(const std::vector<bags::Topic>& topics) {
  std::vector<bags::Topic> found;
  std::ranges::copy_if(topics, std::back_inserter(found), is_pose_topic);
  return found;
}

/// Index of the topic to read.
std::size_t chosen_topic(const bags::Bag& bag, const std::string& name) {
  const std::vector<bags::Topic> poses = pose_topics(bag.topics());
  if (poses.empty()) {
    bag.fail(
        fmt::format("holds no poses: expected a topic of type nav_msgs Odometry, geometry_msgs "
                    "PoseStamped, PoseWithCovarianceStamped or TransformStamped, found {}",
                    bags::words_of(bag.topics())));
  }
  if (name.empty() && poses.size() > 1) {
    throw InvalidArgument(fmt::format("{} is missing: {} holds {} topics of poses, {}",
                                      name_of(kSetting.trajectory_topic), bag.path(), poses.size(),
                                      bags::words_of(poses)));
  }
  const auto is_meant = [&](const bags::Topic& topic) {
    return is_pose_topic(topic) && (name.empty() || topic.name == name);
  };
  const auto& topics = bag.topics();
  const auto found = std::ranges::find_if(topics, is_meant);
  if (found == topics.end()) {
    throw InvalidArgument(fmt::format("{} = {}: {} holds the poses of {}",
                                      name_of(kSetting.trajectory_topic), name, bag.path(),
                                      bags::words_of(poses)));
  }
  if (std::find_if(found + 1, topics.end(), is_meant) != topics.end()) {
    bag.fail(fmt::format("the topic {} has poses of several types, expected one: {}", name,
                         bags::words_of(poses)));
  }
  return static_cast<std::size_t>(found - topics.begin());
}

/// The standard deviations in a covariance; nothing if it states none, as with zeros, -1, or the
/// large numbers used for "unknown".
std::optional<PoseAccuracy> stated_accuracy(const RosPose& pose,
                                            const Eigen::Quaterniond& frame_from_body) {
  if (!pose.covariance || !pose.covariance->allFinite()) return std::nullopt;
  const auto deviation = [](double variance, double most) -> std::optional<double> {
    if (!(variance > 0 && variance <= most * most)) return std::nullopt;
    return std::sqrt(variance);
  };
  const auto& c = *pose.covariance;
  constexpr double kWorstStated = 1e4;  // m
  const auto north = deviation(c(1, 1), kWorstStated), east = deviation(c(0, 0), kWorstStated),
             down = deviation(c(2, 2), kWorstStated);
  // Rotations about the levelled forward and right axes of the body.
  const double heading =
      roll_pitch_heading(Frame::local, Eigen::Vector3d::Zero(), frame_from_body).heading;
  const Eigen::Vector2d forward(std::sin(heading), std::cos(heading)),  // east, north
      right(std::cos(heading), -std::sin(heading));
  const Eigen::Matrix2d tilts = c.block<2, 2>(3, 3);
  const auto roll = deviation(forward.dot(tilts * forward), kPi),
             pitch = deviation(right.dot(tilts * right), kPi), vertical = deviation(c(5, 5), kPi);
  if (!north || !east || !down || !roll || !pitch || !vertical) return std::nullopt;
  return PoseAccuracy{{*north, *east, *down}, *roll, *pitch, *vertical};
}

/// Contents of the messages other than times and poses, removed from all rows if one lacks them.
struct PosesOfTopic {
  std::vector<PoseRow> rows;
  std::size_t without_accuracy = 0, without_velocity = 0;
  std::size_t zero_stamps = 0;
  std::string frame, body;
};

void add_ros_pose(const bags::Bag& bag, const bags::Message& message, const RosPose& pose,
                  PosesOfTopic& all) {
  if (all.rows.empty()) {
    all.frame = pose.frame;
    all.body = pose.body;
    constexpr std::string_view kGeocentricFrame = "earth";  // REP 105
    if (pose.frame == kGeocentricFrame) {
      bag.fail(message,
               "is in the frame earth, which is geocentric; expected a frame with z up (map, odom, "
               "or one of its own)");
    }
  } else if (pose.frame != all.frame || pose.body != all.body) {
    bag.fail(message, fmt::format("is the pose of \"{}\" in the frame \"{}\", but earlier messages "
                                  "are of \"{}\" in \"{}\"; expected one body in one frame",
                                  pose.body, pose.frame, all.body, all.frame));
  }
  if (pose.time_ns == 0 && ++all.zero_stamps > 1) {
    bag.fail(message, "has the time stamp 0 like an earlier message: the time stamps were not set");
  }
  PoseRow row;
  row.time_ns = pose.time_ns;
  row.position = pose.position;
  row.attitude = right_down_from_left_up(pose.attitude);
  if (const auto accuracy = stated_accuracy(pose, row.attitude)) {
    row.accuracy = *accuracy;
  } else {
    ++all.without_accuracy;
  }
  if (pose.velocity && pose.velocity->allFinite()) {
    row.velocity = *pose.velocity;
  } else {
    ++all.without_velocity;
  }
  all.rows.push_back(row);
}

bool is_bag(const FileHead& head) { return bags::bag_kind(head.bytes).has_value(); }

}  // namespace

bool holds_poses_alone(const std::string& path, const Progress& progress) {
  const std::vector<bags::Topic> topics = bags::list_topics(path, progress);
  return std::ranges::any_of(topics, is_pose_topic) && std::ranges::none_of(topics, is_lidar_topic);
}

Trajectory read_ros_bag(const std::string& path, const std::string& topic_name,
                        const Progress& progress) {
  const std::unique_ptr<bags::Bag> bag = bags::open_bag(path, progress);
  const std::size_t chosen = chosen_topic(*bag, topic_name);
  const bags::Topic& topic = bag->topics()[chosen];
  std::vector<bool> wanted(bag->topics().size(), false);
  wanted[chosen] = true;
  bag->rewind(wanted);

  PosesOfTopic all;
  bags::Message message;
  while (bag->next(message)) {
    constexpr std::size_t kOften = 4096;
    if (all.rows.size() % kOften == 0) progress.report(bag->fraction_read());
    RosPose pose;
    try {
      pose = decode_ros_pose(topic.serialisation, *topic.kind, message.bytes);
    } catch (const bags::BadMessage& bad) {
      bag->fail(message, bad.what());
    }
    add_ros_pose(*bag, message, pose, all);
  }
  if (all.rows.empty()) bag->fail(fmt::format("the topic {} holds no message", topic.name));

  RowContents contents;
  contents.format = bags::name_of(bag->kind());
  contents.frame = Frame::local;
  contents.has_velocity = all.without_velocity == 0;
  contents.has_accuracy = all.without_accuracy == 0;
  contents.velocity_axes = VelocityAxes::body_up;
  PoseRows rows(path, contents);
  const auto warn_of_part = [&](std::size_t without, const char* what) {
    if (without == 0 || without == all.rows.size()) return;
    warn(rows.warnings(), kWarning.columns_unused,
         "{} of {} messages of topic {} state no {}; they were ignored for the others, too",
         without, all.rows.size(), topic.name, what);
  };
  warn_of_part(all.without_accuracy, "accuracies of position and attitude");
  warn_of_part(all.without_velocity, "velocities");
  append(rows.warnings(), bag->warnings());
  for (const PoseRow& row : all.rows) rows.add(row, {});
  Trajectory trajectory = rows.finish();
  trajectory.time_scale = scale_by_size(trajectory.time_ns);
  trajectory.source = fmt::format("topic {} ({}), frame \"{}\"", topic.name, topic.type, all.frame);
  if (!all.body.empty()) trajectory.source += fmt::format(", body \"{}\"", all.body);
  return trajectory;
}

const Format kRosBagFormat{"ros-bag",
                           "",
                           "ROS 1 or ROS 2 bag, also as MCAP: odometry, poses, transforms",
                           is_bag,
                           [](const std::string& path, const Progress& progress) {
                             return read_ros_bag(path, {}, progress);
                           },
                           nullptr};

}  // namespace risley::trajectories
