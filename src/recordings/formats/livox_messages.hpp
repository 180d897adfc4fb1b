// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Common part of bags of all kinds: the messages of lidar drivers and their conversion to rows.
//
// Times. A CustomMsg gives each point a time, and so does a PointCloud2 with a field of times
// (cloud_times.hpp). Otherwise it gives only the time of its first point: a point's own time is
// counted from there on the grid of the sensor's shots (100 or 240 kHz, one to three returns per
// shot), which is found from the number of points and the stamps of the first messages. Times from
// the year 2000 on are taken as UTC (PTP may serve TAI, which messages do not show), earlier ones
// as counted from power-on.
//
// Offset times that grow from message to message as the time of the messages does are taken as
// counted from the first message.
//
// The driver of the second generation divides the time of a packet by its number of points, not of
// steps, and truncates: the points of a Mid-360 are 4947 ns apart, until the next packet begins,
// and those of a HAP 2189 ns. They are restored to their firing times. Versions that name no lines
// keep the order of the points, which gives their emitters.
//
// Sensors. Every topic of points is one device, or one for each lidar number in its CustomMsg if
// drivers publish several sensors together; its serial is the broadcast code at the end of the
// topic, if there is one. Messages do not name the model: it is determined only if the shot
// interval, the tags and the returns leave a single one.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "risley/bags/bag.hpp"
#include "risley/bags/message_fields.hpp"
#include "risley/core/error.hpp"
#include "risley/recordings/livox/packet.hpp"
#include "risley/recordings/reader.hpp"

#include "recordings/formats/cloud_times.hpp"

namespace risley::recordings {

using bags::BadMessage;
using bags::MessageKind;

/// One point of a message.
struct MessagePoint {
  std::int64_t offset_ns = 0;        ///< after the message's time; 0 in a cloud without times
  double x = 0.0, y = 0.0, z = 0.0;  ///< m
  std::uint8_t intensity = 0, tag = 0, line = 0;
};

/// A message of a lidar after decoding.
struct LidarMessage {
  std::size_t topic = 0;      ///< index of the topic
  std::int64_t time_ns = 0;   ///< of the first point, or of the inertial sample
  std::int64_t stamp_ns = 0;  ///< of the header
  std::uint8_t lidar = 0;     ///< the driver's number for the sensor
  std::vector<MessagePoint> points;
  bool has_intensity = true;
  std::array<double, 3> angular_velocity{};  ///< rad/s
  std::array<double, 3> acceleration{};      ///< g from Livox drivers, m/s^2 from others
  PointCloud2 cloud;                         ///< valid as long as the message's bytes
};

/// Decodes a message and replaces all of `message` but its topic. @throws BadMessage
void decode_lidar_message(MessageKind kind, bags::Serialisation serialisation,
                          std::span<const std::uint8_t> bytes, LidarMessage& message);

/// Converts the messages of a bag to chunks.
class MessageReader final : public Reader {
 public:
  /// Chooses the topics to read and fills in the header, devices included.
  /// @param format  RecordingHeader::format
  /// @throws FileError when no topic holds lidar points
  MessageReader(std::unique_ptr<bags::Bag> bag, std::string_view format);

  bool read(Chunk& chunk, std::size_t max_rows) override;
  double fraction_read() const override { return bag_->fraction_read(); }

 private:
  /// Timing of the points in a cloud topic without times.
  struct CloudGrid {
    livox::ShotGrid grid = livox::kGrid100kHz;
    int returns = 1;
  };
  struct FirstMessages;
  /// Layout of a device's packets in the second generation's driver.
  struct DriverPackets {
    std::int64_t step_ns = 0;       ///< written interval between points; 0: nothing to correct
    std::int64_t tolerance_ns = 0;  ///< of the times of a cloud
    livox::ShotGrid grid;
    bool names_lines = true;
  };

  const std::vector<bags::Topic>& topics() const { return bag_->topics(); }
  /// Chooses the topics of points and those of inertial samples.
  void choose_topics();
  /// Creates devices for the lidars that share a topic.
  void find_lidars();
  /// Completes the header from the first messages.
  void describe();
  /// Finds the fields of times in clouds, from the first messages.
  void find_cloud_times();
  /// Passes the first messages to a function, which returns its number of points if it used points:
  /// so many messages of each of `point_sources` and no more than all together.
  template <class See>
  void look_at_first(std::size_t point_sources, const See& see);
  void rewind();
  /// The next message of a wanted topic, replacing all of `message`. @return false at the end
  bool next(LidarMessage& message);
  /// The times of a cloud's points. @throws BadMessage
  void set_times(LidarMessage& message) const;
  void take_bag_warnings();
  void choose_imu_topics();
  void describe_device(std::size_t topic, std::uint8_t device, FirstMessages& first);
  void describe_numbered_device(std::size_t topic, std::uint8_t device, const FirstMessages& first);
  /// Device of a message of points; empty if it is unknown.
  std::optional<std::uint8_t> device_of(const LidarMessage& message) const;
  /// Clocks of the times and of the stamps, and growing offset times.
  void compare_clocks(std::uint8_t device, const FirstMessages& first);
  /// Whether the points of a topic have times of their own.
  bool has_times(std::size_t topic) const {
    return topics()[topic].kind == MessageKind::points || cloud_times_[topic];
  }
  void settle_cloud_grid(std::size_t topic, FirstMessages& first);
  /// Restores the firing times of points of the second generation's driver.
  void mend_packets(std::uint8_t device, LidarMessage& message) const;
  void append(LidarMessage& message, Chunk& chunk);
  void append_points(const LidarMessage& message, std::uint8_t device, Observations& rows);
  void append_cloud(const LidarMessage& message, std::uint8_t device, Observations& rows) const;
  void append_imu(const LidarMessage& message, std::uint8_t device,
                  std::vector<ImuSample>& samples);

  std::unique_ptr<bags::Bag> bag_;
  std::vector<std::optional<std::uint8_t>> devices_;  ///< by topic; empty when it is not read
  std::vector<std::vector<std::uint8_t>> lidars_;     ///< by topic: numbers that share it
  std::vector<std::optional<std::int64_t>> growth_from_ns_;  ///< by device: offsets count from it
  std::vector<CloudGrid> clouds_;                            ///< by topic
  std::vector<DriverPackets> driver_packets_;                ///< by device
  std::vector<std::optional<CloudTime>> cloud_times_;        ///< by topic
  std::vector<std::string> unused_times_;                    ///< by topic: reason why a field is
                                                             ///< not used
  std::vector<double> acceleration_units_;  ///< by topic: g per unit of the message
  LidarMessage message_;
  std::optional<FileError> failure_;
  std::uint64_t unknown_lidar_points_ = 0;
  bool equal_times_reported_ = false, imu_without_numbers_reported_ = false, ended_ = false;
};

}  // namespace risley::recordings
