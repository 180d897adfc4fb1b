// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What ROS 1 and ROS 2 bags share: the messages of lidar drivers and how they become rows.
//
// Times. A CustomMsg gives each point its own time. A PointCloud2 gives only the time of its first
// point: a point's own time is counted from there on the grid of the sensor's shots (100 or
// 240 kHz, one to three returns per shot), which is found from the number of points and the stamps
// of the first messages. Times from the year 2000 on are taken as UTC (PTP may serve TAI, which
// no message tells), earlier ones as counted from power-on.
//
// Sensors. Every topic of points is one device; its serial is the broadcast code with which the
// topic ends, if it does. Messages do not name the model: it is told only where the shot interval,
// the tags and the returns leave a single one.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/recordings/livox/packet.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::recordings {

/// A message that is not as its type says; the reader adds where it stands.
class BadMessage : public Error {
 public:
  using Error::Error;
};

/// The messages that are read.
enum class MessageKind : std::uint8_t {
  points,  ///< CustomMsg of the Livox drivers
  cloud,   ///< PointCloud2
  imu,     ///< Imu
};

/// A topic of a bag.
struct BagTopic {
  std::string name, type;
  std::optional<MessageKind> kind;  ///< empty for all that is not read
};

/// One point of a message.
struct MessagePoint {
  std::uint32_t offset_ns = 0;       ///< after the message's time; 0 in a cloud
  double x = 0.0, y = 0.0, z = 0.0;  ///< m
  std::uint8_t intensity = 0, tag = 0, line = 0;
};

/// A message after decoding.
struct BagMessage {
  std::size_t topic = 0;     ///< index of the topic
  std::int64_t time_ns = 0;  ///< of the first point, or of the inertial sample
  std::vector<MessagePoint> points;
  bool has_intensity = true;
  std::array<double, 3> angular_velocity{};  ///< rad/s
  std::array<double, 3> acceleration{};      ///< g from Livox drivers, m/s^2 from others
};

/// Bytes of one point of a CustomMsg, without padding.
inline constexpr std::size_t kCustomPointBytes = 19;

/// A time of a message, ns. @throws BadMessage when it is beyond the year 2200
std::int64_t message_time(std::uint64_t time_ns);
/// @throws BadMessage also when the time is negative
std::int64_t message_time(std::int64_t seconds, std::uint32_t nanoseconds);

/// Checks that a sequence can stand in what is left of its message. @throws BadMessage
void require_room(std::string_view what, std::uint64_t count, std::size_t bytes_each,
                  std::size_t bytes_left);

/// Adds a point of a CustomMsg. @throws BadMessage when a coordinate is no number
void append_point(BagMessage& message, const MessagePoint& point);

/// A PointCloud2 up to its points.
struct CloudLayout {
  struct Field {
    std::string name;
    std::uint32_t offset = 0;  ///< from the start of a point
    std::uint8_t datatype = 0;
    std::uint32_t count = 1;
  };
  std::uint32_t height = 0, width = 0, point_step = 0, row_step = 0;
  bool big_endian = false;
  std::vector<Field> fields;
};

/// Turns the data of a PointCloud2 into points. Points whose coordinates are no numbers are shots
/// without return.
/// @throws BadMessage when the layout does not fit itself or the data
void decode_cloud(const CloudLayout& layout, std::span<const std::uint8_t> data,
                  BagMessage& message);

/// Turns the messages of a bag into chunks. A bag kind says how to come to its messages.
class MessageReader : public Reader {
 public:
  bool read(Chunk& chunk, std::size_t max_rows) final;

 protected:
  explicit MessageReader(std::string path) : path_(std::move(path)) {}

  /// Chooses the topics to read and fills in the devices.
  /// @throws FileError when no topic holds lidar points
  void set_topics(std::vector<BagTopic> topics);
  /// Completes the header from the first messages; the last step of a constructor.
  void describe();

  const std::string& path() const { return path_; }
  const std::vector<BagTopic>& topics() const { return topics_; }
  bool is_wanted(std::size_t topic) const { return devices_[topic].has_value(); }
  [[noreturn]] void fail(const std::string& problem) const { throw FileError(path_, {}, problem); }

  /// The next message of a wanted topic, replacing all of `message`.
  /// @return false at the end
  /// @throws FileError
  virtual bool next(BagMessage& message) = 0;
  virtual void rewind() = 0;

 private:
  /// How the points of a cloud topic lie in time.
  struct CloudGrid {
    livox::ShotGrid grid = livox::kGrid100kHz;
    int returns = 1;
  };
  struct FirstMessages;

  void choose_imu_topics();
  void describe_device(std::size_t topic, const FirstMessages& first);
  void settle_cloud_grid(std::size_t topic, const FirstMessages& first);
  void append(const BagMessage& message, Chunk& chunk);
  void append_points(const BagMessage& message, std::uint8_t device, Observations& rows);
  void append_cloud(const BagMessage& message, std::uint8_t device, Observations& rows) const;
  void append_imu(const BagMessage& message, std::uint8_t device, std::vector<ImuSample>& samples);
  void warn(std::string message) { warnings_.push_back({{}, std::move(message), 0}); }

  std::string path_;
  std::vector<BagTopic> topics_;
  std::vector<std::optional<std::uint8_t>> devices_;  ///< by topic; empty when it is not read
  std::vector<CloudGrid> clouds_;                     ///< by topic
  std::vector<double> acceleration_units_;            ///< by topic: g per unit of the message
  BagMessage message_;
  std::optional<FileError> failure_;
  bool equal_times_reported_ = false;
};

}  // namespace risley::recordings
