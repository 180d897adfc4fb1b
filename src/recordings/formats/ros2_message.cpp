// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/ros2_message.hpp"

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include "risley/bags/message_fields.hpp"

namespace risley::recordings {
namespace {

using bags::CdrFields;
using bags::Header;
using bags::message_time;

void skip_doubles(CdrFields& cdr, int count) {
  for (int i = 0; i < count; ++i) cdr.number<double>();
}

void decode_points(CdrFields& cdr, LidarMessage& message) {
  message.stamp_ns = unchecked_stamp(take_header(cdr));
  message.time_ns = message_time(cdr.number<std::uint64_t>());
  cdr.number<std::uint32_t>();  // number of points, also in front of them
  message.lidar = cdr.number<std::uint8_t>();
  for (int i = 0; i < 3; ++i) cdr.number<std::uint8_t>();  // reserve
  const std::uint32_t count = cdr.length("points", kCustomPointBytes);
  message.points.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    MessagePoint point;
    point.offset_ns = cdr.number<std::uint32_t>();
    point.x = cdr.number<float>();
    point.y = cdr.number<float>();
    point.z = cdr.number<float>();
    point.intensity = cdr.number<std::uint8_t>();
    point.tag = cdr.number<std::uint8_t>();
    point.line = cdr.number<std::uint8_t>();
    append_point(message, point);
  }
}

void decode_cloud_message(CdrFields& cdr, LidarMessage& message) {
  const Header header = take_header(cdr);
  message.time_ns = message_time(header);
  CloudLayout layout;
  layout.height = cdr.number<std::uint32_t>();
  layout.width = cdr.number<std::uint32_t>();
  constexpr std::size_t kShortestField = 14;
  const std::uint32_t fields = cdr.length("fields", kShortestField);
  for (std::uint32_t i = 0; i < fields; ++i) {
    CloudLayout::Field field;
    field.name = cdr.text();
    field.offset = cdr.number<std::uint32_t>();
    field.datatype = cdr.number<std::uint8_t>();
    field.count = cdr.number<std::uint32_t>();
    layout.fields.push_back(std::move(field));
  }
  layout.big_endian = cdr.number<std::uint8_t>() != 0;
  layout.point_step = cdr.number<std::uint32_t>();
  layout.row_step = cdr.number<std::uint32_t>();
  decode_cloud(layout, cdr.byte_sequence("values of data"), message);
}

void decode_imu_message(CdrFields& cdr, LidarMessage& message) {
  constexpr int kOrientation = 13, kCovariance = 9;
  const Header header = take_header(cdr);
  message.time_ns = message_time(header);
  skip_doubles(cdr, kOrientation);
  for (double& value : message.angular_velocity) value = cdr.number<double>();
  skip_doubles(cdr, kCovariance);
  for (double& value : message.acceleration) value = cdr.number<double>();
}

}  // namespace

void decode_ros2_message(MessageKind kind, std::span<const std::uint8_t> bytes,
                         LidarMessage& message) {
  message.points.clear();
  message.has_intensity = true;
  CdrFields cdr(bytes);
  switch (kind) {
    case MessageKind::points:
      return decode_points(cdr, message);
    case MessageKind::cloud:
      return decode_cloud_message(cdr, message);
    case MessageKind::imu:
      return decode_imu_message(cdr, message);
    default:
      throw BadMessage{"expected a message of a lidar"};
  }
}

}  // namespace risley::recordings
