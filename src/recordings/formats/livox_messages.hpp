// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What bags of all kinds share: the messages of lidar drivers and how they become rows.
//
// Times. A CustomMsg gives each point its own time, a PointCloud2 where it has a field of times
// (cloud_times.hpp). Otherwise it gives only the time of its first point: a point's own time is
// counted from there on the grid of the sensor's shots (100 or 240 kHz, one to three returns per
// shot), which is found from the number of points and the stamps of the first messages. Times from
// the year 2000 on are taken as UTC (PTP may serve TAI, which no message tells), earlier ones as
// counted from power-on.
//
// Offset times that grow from message to message as the time of the messages does are counted from
// the first message, and are taken so.
//
// The driver of the second generation divides the time of a packet by its number of points, not by
// that of their steps, and cuts the rest: the points of a Mid-360 stand 4947 ns apart, until the
// next packet begins, and those of a HAP 2189 ns. They are put back where they were fired. Versions
// that name no lines keep the order of the points, which says their emitters.
//
// Sensors. Every topic of points is one device, or one for each lidar number that its CustomMsg
// have where drivers publish several sensors together; its serial is the broadcast code with which
// the topic ends, if it does. Messages do not name the model: it is told only where the shot
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
  std::uint8_t lidar = 0;     ///< number that the driver gave the sensor
  std::vector<MessagePoint> points;
  bool has_intensity = true;
  std::array<double, 3> angular_velocity{};  ///< rad/s
  std::array<double, 3> acceleration{};      ///< g from Livox drivers, m/s^2 from others
  CloudLayout layout;                        ///< of a cloud
  std::span<const std::uint8_t> data;        ///< of a cloud, valid as long as the message's bytes
};

/// Bytes of one point of a CustomMsg, without padding.
inline constexpr std::size_t kCustomPointBytes = 19;

/// The stamp of a header that is not needed, whatever it says, ns.
inline std::int64_t unchecked_stamp(const bags::Header& header) {
  return header.seconds * 1'000'000'000 + std::int64_t{header.nanoseconds};
}

/// Adds a point of a CustomMsg. @throws BadMessage when a coordinate is no number
void append_point(LidarMessage& message, const MessagePoint& point);

/// Turns the data of a PointCloud2 into points. Points whose coordinates are no numbers are shots
/// without return.
/// @throws BadMessage when the layout does not fit itself or the data
void decode_cloud(const CloudLayout& layout, std::span<const std::uint8_t> data,
                  LidarMessage& message);

/// Turns the messages of a bag into chunks.
class MessageReader final : public Reader {
 public:
  /// Chooses the topics to read and fills in the header, devices included.
  /// @param format  RecordingHeader::format
  /// @throws FileError when no topic holds lidar points
  MessageReader(std::unique_ptr<bags::Bag> bag, std::string_view format);

  bool read(Chunk& chunk, std::size_t max_rows) override;
  double fraction_read() const override { return bag_->fraction_read(); }

 private:
  /// How the points of a cloud topic without times lie in time.
  struct CloudGrid {
    livox::ShotGrid grid = livox::kGrid100kHz;
    int returns = 1;
  };
  struct FirstMessages;
  /// How the second generation's driver writes the packets of a device.
  struct DriverPackets {
    std::int64_t step_ns = 0;       ///< that it writes between points; 0: nothing to mend
    std::int64_t tolerance_ns = 0;  ///< of the times of a cloud
    livox::ShotGrid grid;
    bool names_lines = true;
  };

  const std::vector<bags::Topic>& topics() const { return bag_->topics(); }
  /// Chooses the topics of points and those of inertial samples.
  void choose_topics();
  /// Makes devices of the lidars that share a topic.
  void find_lidars();
  /// Completes the header from the first messages.
  void describe();
  /// Finds the fields by which clouds tell times, from the first messages.
  void find_cloud_times();
  /// Shows the first messages to a function, which returns its number of points where it took
  /// points: so many messages of each of `point_sources` and no more than all together.
  template <class See>
  void look_at_first(std::size_t point_sources, const See& see);
  void rewind();
  /// The next message of a wanted topic, replacing all of `message`. @return false at the end
  bool next(LidarMessage& message);
  /// The times that a cloud's points tell. @throws BadMessage
  void set_times(LidarMessage& message) const;
  void take_bag_warnings();
  void choose_imu_topics();
  void describe_device(std::size_t topic, std::uint8_t device, FirstMessages& first);
  void describe_numbered_device(std::size_t topic, std::uint8_t device, const FirstMessages& first);
  /// Device of a message of points; empty where it is none of those known.
  std::optional<std::uint8_t> device_of(const LidarMessage& message) const;
  /// Clocks of the times and of the stamps, and offset times that grow.
  void compare_clocks(std::uint8_t device, const FirstMessages& first);
  /// Whether the points of a topic have times of their own.
  bool has_times(std::size_t topic) const {
    return topics()[topic].kind == MessageKind::points || cloud_times_[topic];
  }
  void settle_cloud_grid(std::size_t topic, FirstMessages& first);
  /// Puts the points of the second generation's driver back to when they were fired.
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
  std::vector<std::string> unused_times_;                    ///< by topic: why a field is not used
  std::vector<double> acceleration_units_;  ///< by topic: g per unit of the message
  LidarMessage message_;
  std::optional<FileError> failure_;
  std::uint64_t unknown_lidar_points_ = 0;
  bool equal_times_reported_ = false, imu_without_numbers_reported_ = false, ended_ = false;
};

}  // namespace risley::recordings
