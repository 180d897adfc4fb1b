// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/bag_writer.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/bags/lidar_topic.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"

namespace risley::recordings {
namespace {

constexpr const char* kDriverTopic = "/livox/lidar";

/// Suffix of the topic of one of several sensors, following the drivers where known.
std::string ending_of(const Device& device) {
  if (!device.serial.empty()) return "_" + device.serial;
  if (device.address.empty()) return fmt::format("_{}", device.index);
  std::string address = device.address;
  std::ranges::replace(address, '.', '_');
  return "_" + address;
}

class BagRecordingWriter final : public Writer {
 public:
  BagRecordingWriter(const std::string& path, bags::BagKind kind, const RecordingHeader& header,
                     bags::LidarTopicOptions options)
      : kind_(kind), header_(header) {
    if (!header.has_range) {
      throw InvalidArgument(fmt::format(
          "{}: bags hold points, and the recording has directions without ranges", path));
    }
    if (options.topic.empty()) options.topic = kDriverTopic;
    if (!options.message) options.message = bags::WrittenMessage::custom_driver;
    options_ = std::move(options);
    bag_ = bags::create_bag(path, kind);
    for (const Device& device : header.devices) {
      bags::LidarTopicOptions of_device = options_;
      of_device.topic += ending(device);
      of_device.message = bags::of_generation(*options_.message, is_second_generation(device.type));
      lidars_.emplace_back(*bag_, kind, of_device, std::vector<bags::PointFieldEntry>(),
                           std::size_t{0}, device.index);
    }
    inertia_.resize(lidars_.size());
  }

  void close() override {
    for (bags::LidarTopic& lidar : lidars_) lidar.flush();
    bag_->close();
  }

 private:
  void append(const Chunk& chunk) override {
    const Observations& rows = chunk.observations;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      bags::LidarPoint point{rows.time_ns[i],   0,           0,           0,
                             rows.intensity[i], rows.tag[i], rows.beam[i]};
      if (rows.valid[i] != 0 && rows.range[i] > 0) {
        const Vector3<double> place = rows.range[i] * direction_from_angles(SphericalAngles<double>{
                                                          rows.azimuth[i], rows.zenith[i]});
        point.x = static_cast<float>(place.x);
        point.y = static_cast<float>(place.y);
        point.z = static_cast<float>(place.z);
      }
      lidars_[rows.device[i]].add(point);
    }
    for (const ImuSample& sample : chunk.imu) write(sample);
  }

  std::string ending(const Device& device) const {
    return header_.devices.size() > 1 ? ending_of(device) : std::string();
  }

  /// As Livox's drivers do it: accelerations in g, and no orientation.
  void write(const ImuSample& sample) {
    std::optional<Inertia>& inertia = inertia_[sample.device];
    if (!inertia) {
      const std::string& lidar = options_.topic;
      const std::size_t slash = lidar.rfind('/');
      const std::string space = lidar.substr(0, slash == std::string::npos ? 0 : slash);
      inertia.emplace(Inertia{bag_->add(
          bags::topic_of(fmt::format("{}/imu{}", space, ending(header_.devices[sample.device])),
                         bags::WrittenMessage::imu, bags::serialisation_of(kind_)))});
    }
    const std::uint64_t stamp_ns = lidars_[sample.device].stamp_of(sample.time_ns);
    bags::ImuMessage imu;
    imu.header = bags::header_of(stamp_ns, options_.frame_id, inertia->messages++);
    const auto& [rate_x, rate_y, rate_z] = sample.angular_velocity;
    const auto& [force_x, force_y, force_z] = sample.acceleration_g;
    imu.angular_velocity = {rate_x, rate_y, rate_z};
    imu.linear_acceleration = {force_x, force_y, force_z};
    bags::encode(bags::serialisation_of(kind_), imu, bytes_);
    bags::Message message;
    message.bytes = bytes_;
    message.time_ns = message.publish_time_ns = stamp_ns;
    bag_->write(inertia->topic, message);
  }

  struct Inertia {
    std::size_t topic = 0;
    std::uint32_t messages = 0;
  };

  bags::BagKind kind_;
  RecordingHeader header_;
  bags::LidarTopicOptions options_;
  std::unique_ptr<bags::BagWriter> bag_;
  std::vector<bags::LidarTopic> lidars_;         ///< by device
  std::vector<std::optional<Inertia>> inertia_;  ///< by device
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

std::unique_ptr<Writer> create_bag_recording(const std::string& path, bags::BagKind kind,
                                             const RecordingHeader& header,
                                             const WriteOptions& options) {
  return std::make_unique<BagRecordingWriter>(path, kind, header, options.messages);
}

}  // namespace risley::recordings
