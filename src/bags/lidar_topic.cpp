// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/bags/lidar_topic.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"
#include "risley/io/little_endian.hpp"

namespace risley::bags {
namespace {

constexpr std::uint64_t kSecond = 1'000'000'000;
constexpr std::uint64_t kEarliest_ns = 1;  ///< ros::TIME_MIN

/// The fields of livox_ros_driver2, and the exact time.
std::vector<PointFieldEntry> driver_fields() {
  return {{"x", 0, kFloat32Field},          {"y", 4, kFloat32Field},
          {"z", 8, kFloat32Field},          {"intensity", 12, kFloat32Field},
          {"tag", 16, kUint8Field},         {"line", 17, kUint8Field},
          {"timestamp", 18, kFloat64Field}, {"offset_time", 26, kUint32Field}};
}
constexpr std::size_t kDriverBytes = 30;

}  // namespace

Header header_of(std::uint64_t stamp_ns, const std::string& frame, std::uint32_t sequence) {
  return {static_cast<std::int64_t>(stamp_ns / kSecond),
          static_cast<std::uint32_t>(stamp_ns % kSecond), frame, sequence};
}

LidarTopic::LidarTopic(BagWriter& bag, BagKind kind, const LidarTopicOptions& options,
                       std::vector<PointFieldEntry> more, std::size_t more_bytes,
                       std::uint8_t lidar_id)
    : bag_(bag),
      serialisation_(serialisation_of(kind)),
      options_(options),
      is_cloud_(options.message.value_or(WrittenMessage::cloud) == WrittenMessage::cloud),
      frame_ns_(0),
      point_bytes_(is_cloud_ ? kDriverBytes : CustomPoint::kBytes),
      more_bytes_(is_cloud_ ? more_bytes : 0) {
  require_between(kSetting.frame_rate, options.frame_rate, kSlowestFrames, kFastestFrames);
  if (options.topic.empty()) {
    throw InvalidArgument(fmt::format("{} is empty, expected a name", name_of(kSetting.topic)));
  }
  frame_ns_ = static_cast<std::uint64_t>(std::llround(1e9 / options.frame_rate));
  topic_ = bag.add(topic_of(options.topic, *options_.message, serialisation_));
  cloud_.fields = driver_fields();
  for (PointFieldEntry& field : more) {
    field.offset += static_cast<std::uint32_t>(kDriverBytes);
    cloud_.fields.push_back(std::move(field));
  }
  cloud_.point_step = static_cast<std::uint32_t>(point_bytes_ + more_bytes_);
  cloud_.height = 1;
  custom_.lidar_id = lidar_id;
}

std::uint64_t LidarTopic::stamp_of(std::int64_t time_ns) {
  if (!shift_ns_) {
    shift_ns_ = time_ns < static_cast<std::int64_t>(kEarliest_ns)
                    ? since(time_ns, static_cast<std::int64_t>(kEarliest_ns))
                    : 0;
  }
  const auto moved = static_cast<std::uint64_t>(time_ns) + *shift_ns_;
  const bool early = time_ns < 0 ? since(time_ns, 0) >= *shift_ns_ : moved < kEarliest_ns;
  const std::uint64_t stamp = early ? kEarliest_ns : moved;
  // Seconds have 32 bits in ROS 1, and one of these is the sign in ROS 2.
  const std::uint64_t last = serialisation_ == Serialisation::ros1
                                 ? std::numeric_limits<std::uint32_t>::max()
                                 : std::numeric_limits<std::int32_t>::max();
  if (stamp / kSecond > last) {
    throw InvalidArgument(
        fmt::format("topic {}: time of a point = {} s, allowed in bags up to {} s after {} s",
                    options_.topic, time_ns / static_cast<std::int64_t>(kSecond), last,
                    -static_cast<double>(*shift_ns_) / static_cast<double>(kSecond)));
  }
  return stamp;
}

void LidarTopic::begin(std::int64_t time_ns) {
  flush();
  stamp_ns_ = stamp_of(time_ns);
  begin_ns_ = time_ns;
}

void LidarTopic::append(const LidarPoint& point, const std::uint8_t* more) {
  if (!std::isfinite(point.x + point.y + point.z)) {
    throw InvalidArgument(fmt::format("topic {}: a point at {}, {}, {} m, allowed finite numbers",
                                      options_.topic, point.x, point.y, point.z));
  }
  const auto offset_ns = static_cast<std::uint32_t>(since(*begin_ns_, point.time_ns));
  const std::size_t at = buffer_.size();
  buffer_.resize(at + point_bytes_ + more_bytes_);
  std::uint8_t* to = buffer_.data() + at;
  if (is_cloud_) {
    const float numbers[] = {point.x, point.y, point.z, static_cast<float>(point.intensity)};
    std::memcpy(to, numbers, sizeof numbers);
    to[16] = point.tag;
    to[17] = point.line;
    io::store<double>(to + 18, static_cast<double>(point.time_ns));
    io::store<std::uint32_t>(to + 26, offset_ns);
    if (more_bytes_ > 0) std::memcpy(to + kDriverBytes, more, more_bytes_);
    return;
  }
  io::store<std::uint32_t>(to, offset_ns);
  const float numbers[] = {point.x, point.y, point.z};
  std::memcpy(to + 4, numbers, sizeof numbers);
  to[16] = point.intensity;
  to[17] = point.tag;
  to[18] = point.line;
}

void LidarTopic::flush() {
  if (!begin_ns_) return;
  const auto points = static_cast<std::uint32_t>(buffer_.size() / (point_bytes_ + more_bytes_));
  const Header header = header_of(stamp_ns_, options_.frame_id, messages_++);
  if (is_cloud_) {
    cloud_.header = header;
    cloud_.width = points;
    cloud_.row_step = static_cast<std::uint32_t>(buffer_.size());
    cloud_.data = buffer_;
    encode(serialisation_, cloud_, message_);
  } else {
    custom_.header = header;
    custom_.timebase = stamp_ns_;
    custom_.point_num = points;
    custom_.points = {buffer_, points};
    encode(serialisation_, custom_, message_);
  }
  Message written;
  written.bytes = message_;
  written.time_ns = written.publish_time_ns = stamp_ns_;
  bag_.write(topic_, written);
  buffer_.clear();
  begin_ns_.reset();
}

}  // namespace risley::bags
