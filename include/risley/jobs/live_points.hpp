// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "risley/bags/bag_writer.hpp"
#include "risley/bags/lidar_topic.hpp"
#include "risley/jobs/given.hpp"
#include "risley/jobs/optics_watch.hpp"
#include "risley/recordings/livox/packet.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// Possible messages per second with points of a running sensor, Hz.
inline constexpr double kSlowestLiveFrames = 10;
inline constexpr double kFastestLiveFrames = 50;  ///< messages per second, Hz
inline constexpr double kLiveFrames = 20;         ///< usual messages per second, Hz

/// Points to make from running sensors.
struct LivePointsOptions {
  /// As CloudOfRecordingOptions::calibration; one with a serial number applies only to the sensor
  /// of that number. Every other sensor uses the preset of its type, and directions as reported.
  GivenSensor calibration;
  /// With several sensors each has its own topic, with its serial number after this one.
  bags::LidarTopicOptions messages = {
      .topic = "/risley/points", .frame_rate = kLiveFrames, .message = bags::WrittenMessage::cloud};
  /// Takes the messages, from one thread for each sensor, as CDR; must outlive the points.
  bags::BagWriter* bag = nullptr;
};

/// Checks options before there is a sensor. @return the calibration; empty if none is given
/// @throws InvalidArgument, FileError
std::optional<sensors::Sensor> require_usable(const LivePointsOptions& options);

/// Result so far for a sensor's packets.
struct PublishedPoints {
  std::string calibration;     ///< name of the calibration or preset; empty if there is none
  bool is_calibrated = false;  ///< the calibration was given
  std::string words;           ///< reason why there are no points now; empty if there are, or soon
                               ///< will be
  std::uint64_t points = 0, frames = 0;
  /// Packets that came too late or too fast: the recording has them.
  std::uint64_t missing_packets = 0;
  /// Time from the arrival of a frame's first packet to the frame: 99 % of the frames are faster,
  /// and the slowest, s. Frames from the initial analysis of the sensor are excluded.
  std::optional<double> latency, longest_latency;
};

/// Makes points of sensors as their packets arrive, as CloudMaker does with CloudOptions::live, on
/// a thread for each. The caller that adds packets never waits.
class LivePoints {
 public:
  /// Most waiting packets of a sensor: eight seconds of the fastest.
  static constexpr std::size_t kMostWaiting = 20'000;

  /// @throws FileError, InvalidArgument
  LivePoints(const std::vector<WatchedSensor>& sensors, const LivePointsOptions& options);
  ~LivePoints();  ///< forgets what still waits
  LivePoints(const LivePoints&) = delete;
  LivePoints& operator=(const LivePoints&) = delete;

  /// Shot grid of special firmware, before the first packet of a sensor.
  void set_grid(std::size_t sensor, const recordings::livox::ShotGrid& grid);
  /// Adds a packet as it arrives; some milliseconds of disorder are corrected.
  /// @param sensor   its place in the list
  /// @param host_ns  when it came
  void add(std::size_t sensor, std::span<const std::uint8_t> packet, std::int64_t host_ns);
  /// Ends the input: waits until all points are made, or until the time limit.
  /// @param longest  s
  void finish(double longest);
  /// Results so far [sensors].
  std::vector<PublishedPoints> published() const;

 private:
  class Unit;
  std::vector<std::unique_ptr<Unit>> units_;
};

}  // namespace risley::jobs
