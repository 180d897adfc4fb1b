// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>

#include <fmt/format.h>

#include "risley/bags/messages.hpp"

#include "recordings/formats/cloud_times.hpp"
#include "recordings/formats/livox_messages.hpp"

namespace risley::recordings {
namespace {

/// The stamp of a header that is not needed, whatever it says, ns.
std::int64_t unchecked_stamp(const bags::Header& header) {
  return header.seconds * 1'000'000'000 + std::int64_t{header.nanoseconds};
}

void take_points(const bags::CustomMessage& from, LidarMessage& message) {
  message.stamp_ns = unchecked_stamp(from.header);
  message.time_ns = bags::message_time(from.timebase);
  message.lidar = from.lidar_id;
  message.points.reserve(from.points.count);
  for (std::size_t i = 0; i < from.points.count; ++i) {
    const bags::CustomPoint point = from.points[i];
    if (!std::isfinite(point.x + point.y + point.z)) {
      throw BadMessage{fmt::format("point {} has a coordinate that is not a number", i + 1)};
    }
    message.points.push_back(
        {point.offset_time, point.x, point.y, point.z, point.reflectivity, point.tag, point.line});
  }
}

/// Points with non-numeric coordinates are shots without return.
void take_cloud(const PointCloud2& cloud, LidarMessage& message) {
  message.time_ns = bags::message_time(cloud.header);
  const CloudField x = required_field(cloud, "x"), y = required_field(cloud, "y"),
                   z = required_field(cloud, "z");
  const CloudField intensity = find_field(cloud, {"intensity"}), tag = find_field(cloud, {"tag"}),
                   line = find_field(cloud, {"line", "beam"});
  message.has_intensity = static_cast<bool>(intensity);
  message.points.reserve(bags::count_points(cloud));
  for_each_point(cloud, [&](const std::uint8_t* bytes) {
    MessagePoint point;
    point.x = x(bytes);
    point.y = y(bytes);
    point.z = z(bytes);
    // Also numbers whose squares overflow.
    if (!std::isfinite(point.x * point.x + point.y * point.y + point.z * point.z)) {
      point.x = point.y = point.z = 0.0;
    }
    point.intensity = intensity.byte(bytes);
    point.tag = tag.byte(bytes);
    point.line = line.byte(bytes);
    message.points.push_back(point);
  });
}

void take_inertia(const bags::ImuMessage& from, LidarMessage& message) {
  message.time_ns = bags::message_time(from.header);
  const bags::MessageVector &rate = from.angular_velocity, &force = from.linear_acceleration;
  message.angular_velocity = {rate.x, rate.y, rate.z};
  message.acceleration = {force.x, force.y, force.z};
}

}  // namespace

void decode_lidar_message(MessageKind kind, bags::Serialisation serialisation,
                          std::span<const std::uint8_t> bytes, LidarMessage& message) {
  message.points.clear();
  message.has_intensity = true;
  const auto decoded = [&](auto empty) {
    bags::decode(serialisation, bytes, empty);
    return empty;
  };
  switch (kind) {
    case MessageKind::points:
      return take_points(decoded(bags::CustomMessage{}), message);
    case MessageKind::cloud:
      message.cloud = decoded(PointCloud2{});
      return take_cloud(message.cloud, message);
    case MessageKind::imu:
      return take_inertia(decoded(bags::ImuMessage{}), message);
    default:
      throw BadMessage{"expected a message of a lidar"};
  }
}

}  // namespace risley::recordings
