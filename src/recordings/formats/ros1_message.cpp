// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/ros1_message.hpp"

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "risley/bags/message_fields.hpp"
#include "risley/io/little_endian.hpp"

namespace risley::recordings {
namespace {

using bags::Header;
using bags::message_time;
using bags::require_room;
using bags::Ros1Fields;
using io::load;

void decode_points(Ros1Fields bytes, LidarMessage& message) {
  message.stamp_ns = unchecked_stamp(take_header(bytes));
  message.time_ns = message_time(bytes.number<std::uint64_t>("the time base"));
  bytes.number<std::uint32_t>("the number of points");
  message.lidar = bytes.take(4, "bytes of lidar number and reserve").front();
  const auto count = bytes.number<std::uint32_t>("the length of the points");
  require_room("points", count, kCustomPointBytes, bytes.left());
  message.points.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint8_t* at = bytes.take(kCustomPointBytes, "bytes of a point").data();
    append_point(message, {load<std::uint32_t>(at), load<float>(at + 4), load<float>(at + 8),
                           load<float>(at + 12), at[16], at[17], at[18]});
  }
  bytes.require_end();
}

void decode_cloud_message(Ros1Fields bytes, LidarMessage& message) {
  const Header header = take_header(bytes);
  message.time_ns = message_time(header);
  CloudLayout layout;
  layout.height = bytes.number<std::uint32_t>("the height");
  layout.width = bytes.number<std::uint32_t>("the width");
  const auto fields = bytes.number<std::uint32_t>("the number of fields");
  constexpr std::size_t kShortestField = 13;
  require_room("fields", fields, kShortestField, bytes.left());
  for (std::uint32_t i = 0; i < fields; ++i) {
    CloudLayout::Field field;
    field.name = bytes.text("characters of a field's name");
    field.offset = bytes.number<std::uint32_t>("a field's offset");
    field.datatype = bytes.number<std::uint8_t>("a field's datatype");
    field.count = bytes.number<std::uint32_t>("a field's count");
    layout.fields.push_back(std::move(field));
  }
  layout.big_endian = bytes.number<std::uint8_t>("the byte order") != 0;
  layout.point_step = bytes.number<std::uint32_t>("the bytes per point");
  layout.row_step = bytes.number<std::uint32_t>("the bytes per row");
  const auto data_bytes = bytes.number<std::uint32_t>("the length of the data");
  const auto data = bytes.take(data_bytes, "bytes of data");
  bytes.number<std::uint8_t>("the mark of density");
  bytes.require_end();
  decode_cloud(layout, data, message);
}

void decode_imu_message(Ros1Fields bytes, LidarMessage& message) {
  constexpr std::size_t kOrientation = 13 * sizeof(double), kCovariance = 9 * sizeof(double);
  const Header header = take_header(bytes);
  message.time_ns = message_time(header);
  bytes.take(kOrientation, "bytes of the orientation");
  for (double& value : message.angular_velocity) value = bytes.number<double>("angular velocity");
  bytes.take(kCovariance, "bytes of a covariance");
  for (double& value : message.acceleration) value = bytes.number<double>("acceleration");
  bytes.take(kCovariance, "bytes of a covariance");
  bytes.require_end();
}

}  // namespace

void decode_ros1_message(MessageKind kind, std::span<const std::uint8_t> bytes,
                         LidarMessage& message) {
  message.points.clear();
  message.has_intensity = true;
  const Ros1Fields all(bytes);
  switch (kind) {
    case MessageKind::points:
      return decode_points(all, message);
    case MessageKind::cloud:
      return decode_cloud_message(all, message);
    case MessageKind::imu:
      return decode_imu_message(all, message);
    default:
      throw BadMessage{"expected a message of a lidar"};
  }
}

}  // namespace risley::recordings
