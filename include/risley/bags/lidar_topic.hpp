// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/bags/bag_writer.hpp"
#include "risley/bags/messages.hpp"

namespace risley::bags {

/// How points become messages.
struct LidarTopicOptions {
  std::string topic;                      ///< empty: what the caller takes
  std::string frame_id = "livox_frame";   ///< of the messages' headers
  double frame_rate = 10;                 ///< messages per second, Hz
  std::optional<WrittenMessage> message;  ///< of points; empty: as the caller chooses
};

/// Allowed messages per second, Hz.
inline constexpr double kSlowestFrames = 0.25,  ///< because offsets of points have 32 bits of ns
    kFastestFrames = 1000;                      ///< some shots in each

/// A point as messages have it.
struct LidarPoint {
  std::int64_t time_ns = 0;
  float x = 0, y = 0, z = 0;  ///< m
  std::uint8_t intensity = 0, tag = 0, line = 0;
};

/// Header of a message. @param stamp_ns  time on the bag's clock
Header header_of(std::uint64_t stamp_ns, const std::string& frame, std::uint32_t sequence);

/// Divides the points of one sensor into messages of a topic. A message begins at the time of its
/// first point and covers 1 / frame_rate; a clock that goes back also begins a message. A
/// PointCloud2 has the fields of livox_ros_driver2 (x, y, z, intensity, tag, line, timestamp in ns)
/// and "offset_time", ns after the stamp, because doubles are too coarse for today's times. Bags
/// hold no time before 1 ns: if the first point is earlier, all stamps are shifted so that it is at
/// 1 ns, and a later message that would still be earlier is stamped 1 ns. "timestamp" is never
/// moved.
class LidarTopic {
 public:
  /// @param options  with topic and message
  /// @param more  further fields after the driver's, in a PointCloud2; offsets count from the first
  /// of them
  /// @param more_bytes  their size in a point
  /// @param lidar_id  of a CustomMsg
  /// @throws InvalidArgument for an empty topic or a frame rate beyond the bounds; FileError
  LidarTopic(BagWriter& bag, BagKind kind, const LidarTopicOptions& options,
             std::vector<PointFieldEntry> more = {}, std::size_t more_bytes = 0,
             std::uint8_t lidar_id = 0);

  /// @param more  the further fields, more_bytes of them
  /// @throws InvalidArgument for a time beyond the range of bags; FileError
  void add(const LidarPoint& point, const std::uint8_t* more = nullptr) {
    if (!begin_ns_ || buffer_.size() + point_bytes_ + more_bytes_ > kMostBytes ||
        point.time_ns < *begin_ns_ || since(*begin_ns_, point.time_ns) >= frame_ns_) {
      begin(point.time_ns);
    }
    append(point, more);
  }

  /// Writes the points added since the last message.
  void flush();

  /// A time on the bag's clock, ns. @throws InvalidArgument for a time beyond the range of bags
  std::uint64_t stamp_of(std::int64_t time_ns);

 private:
  static constexpr std::size_t kMostBytes = std::size_t{1} << 24;  ///< of points in one message

  static std::uint64_t since(std::int64_t earlier, std::int64_t later) {
    return static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier);
  }
  void begin(std::int64_t time_ns);
  void append(const LidarPoint& point, const std::uint8_t* more);

  BagWriter& bag_;
  Serialisation serialisation_;
  LidarTopicOptions options_;
  bool is_cloud_;
  std::size_t topic_ = 0;
  std::uint64_t frame_ns_;
  std::size_t point_bytes_, more_bytes_;
  PointCloud2 cloud_;
  CustomMessage custom_;
  std::vector<std::uint8_t> buffer_, message_;
  std::optional<std::int64_t> begin_ns_;   ///< of the message that grows
  std::optional<std::uint64_t> shift_ns_;  ///< from the recording's clock to the bag's
  std::uint64_t stamp_ns_ = 0;
  std::uint32_t messages_ = 0;
};

}  // namespace risley::bags
