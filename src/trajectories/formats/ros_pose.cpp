// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "trajectories/formats/ros_pose.hpp"

#include <fmt/format.h>

#include "risley/bags/message_fields.hpp"

#include "trajectories/formats/pose_rows.hpp"

namespace risley::trajectories {
namespace {

using bags::BadMessage;
using bags::MessageKind;

template <class Fields>
Eigen::Vector3d take_vector(Fields& fields, std::string_view what) {
  Eigen::Vector3d value;
  for (double& component : value) component = fields.template number<double>(what);
  return value;
}

template <class Fields>
void take_position_and_attitude(Fields& fields, RosPose& pose) {
  pose.position = take_vector(fields, "the position");
  if (!pose.position.allFinite()) {
    throw BadMessage{fmt::format("the position is ({}, {}, {}) m, expected finite numbers",
                                 pose.position.x(), pose.position.y(), pose.position.z())};
  }
  const Eigen::Vector3d vector = take_vector(fields, "the orientation");
  const auto w = fields.template number<double>("the orientation");
  const Eigen::Quaterniond stated(w, vector.x(), vector.y(), vector.z());
  const auto unit = unit_quaternion(stated);
  if (!unit) {
    throw BadMessage{fmt::format(
        "expected an orientation of length 1, found the quaternion x, y, z, w = {}, {}, {}, {}",
        stated.x(), stated.y(), stated.z(), stated.w())};
  }
  pose.attitude = *unit;
}

template <class Fields>
void take_covariance(Fields& fields, RosPose& pose) {
  pose.covariance.emplace();
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = 0; column < 6; ++column) {
      (*pose.covariance)(row, column) = fields.template number<double>("the covariance");
    }
  }
}

template <class Fields>
RosPose take_ros_pose(Fields&& fields, MessageKind kind) {
  RosPose pose;
  const bags::Header header = take_header(fields);
  constexpr std::uint32_t kWholeSecond = 1'000'000'000;
  if (header.nanoseconds >= kWholeSecond) {
    throw BadMessage{
        fmt::format("expected a stamp of less than 1e9 ns beside its seconds, found "
                    "{}",
                    header.nanoseconds)};
  }
  pose.time_ns = message_time(header);
  pose.frame = header.frame;
  switch (kind) {
    case MessageKind::odometry:
      pose.body = fields.text("characters of the body's name");
      take_position_and_attitude(fields, pose);
      take_covariance(fields, pose);
      pose.velocity = take_vector(fields, "the velocity");
      take_vector(fields, "the angular velocity");
      for (int i = 0; i < 36; ++i) fields.template number<double>("the covariance of velocities");
      break;
    case MessageKind::pose:
      take_position_and_attitude(fields, pose);
      break;
    case MessageKind::pose_with_covariance:
      take_position_and_attitude(fields, pose);
      take_covariance(fields, pose);
      break;
    case MessageKind::transform:
      pose.body = fields.text("characters of the body's name");
      take_position_and_attitude(fields, pose);
      break;
    default:
      throw BadMessage{"expected a message that holds a pose"};
  }
  fields.require_end();
  return pose;
}

}  // namespace

bool holds_pose(MessageKind kind) {
  return kind == MessageKind::odometry || kind == MessageKind::pose ||
         kind == MessageKind::pose_with_covariance || kind == MessageKind::transform;
}

RosPose decode_ros_pose(bags::Serialisation serialisation, MessageKind kind,
                        std::span<const std::uint8_t> bytes) {
  return serialisation == bags::Serialisation::ros1 ? take_ros_pose(bags::Ros1Fields(bytes), kind)
                                                    : take_ros_pose(bags::CdrFields(bytes), kind);
}

}  // namespace risley::trajectories
