// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What stands inside files and streams, given to its decoder without them.
#include <algorithm>
#include <array>
#include <cmath>

#include "risley/bags/bag.hpp"
#include "risley/bags/messages.hpp"
#include "risley/recordings/livox/numbered_order.hpp"
#include "risley/recordings/livox/packet_decoder.hpp"

#include "fuzz/invariants.hpp"
#include "fuzz/targets.hpp"
#include "recordings/formats/livox_messages.hpp"
#include "trajectories/formats/ros_pose.hpp"

namespace risley::fuzz {
namespace {

using recordings::Chunk;

/// Packets of one sensor one after the other: a byte says how long each is.
void run_packets(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;
  recordings::livox::PacketDecoderOptions options;
  options.device_type = bytes[0] & 7U;
  options.float_points = (bytes[0] & 8U) != 0;
  bytes = bytes.subspan(1);
  recordings::livox::PacketDecoder decoder(options);
  recordings::RecordingHeader header;
  header.devices.resize(1);
  Chunk chunk;
  while (!bytes.empty()) {
    const std::size_t length = std::min<std::size_t>(bytes.size() - 1, 16U * bytes[0]);
    const std::size_t rows = chunk.observations.size();
    try {
      decoder.decode(bytes.subspan(1, length), chunk);
      require(chunk.observations.size() <= rows + length, "no more rows than bytes");
    } catch (const recordings::livox::BadPacket& bad) {
      require(bad.byte_offset() <= length, "what is wrong stands in the packet");
      require(chunk.observations.size() == rows, "a bad packet leaves no rows");
    } catch (const InvalidArgument&) {  // a device that needs a grid
      require(chunk.observations.size() == rows, "a refused packet leaves no rows");
    }
    bytes = bytes.subspan(1 + length);
  }
  require_sound(chunk, header);
}

/// Packets of one sensor of the second generation: two bytes say how long each is.
void run_numbered_packets(std::span<const std::uint8_t> bytes) {
  using namespace recordings::livox;
  if (bytes.empty()) return;
  const std::uint8_t type = bytes[0];
  bytes = bytes.subspan(1);
  recordings::RecordingHeader header;
  header.devices.resize(1);
  Chunk chunk;
  NumberedOrder order;
  std::uint64_t given = 0, taken = 0;
  while (bytes.size() > 2) {
    const std::size_t length = std::min<std::size_t>(bytes.size() - 2, bytes[0] + 256U * bytes[1]);
    const auto packet = bytes.subspan(2, length);
    const std::size_t rows = chunk.observations.size();
    try {
      decode_numbered_packet(packet, type, 0, chunk);
      require(chunk.observations.size() <= rows + length, "no more rows than bytes");
    } catch (const BadPacket& bad) {
      require(bad.byte_offset() <= length, "what is wrong stands in the packet");
      require(chunk.observations.size() == rows, "a bad packet leaves no rows");
    }
    ++given;
    order.add(packet, static_cast<std::int64_t>(given) * 480'000);
    taken += order.take().size();
    bytes = bytes.subspan(2 + length);
  }
  order.flush();
  taken += order.take().size();
  const PacketCounts& counts = order.counts();
  require(taken == counts.packets, "what is counted is given");
  require(counts.packets + counts.duplicates + counts.late + counts.rejected <= given,
          "each packet is one of these");
  require_sound(chunk, header);
}

/// A message of each kind: the first byte says which.
template <bags::Serialisation Serialisation>
void run_message(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;
  const auto kind = static_cast<bags::MessageKind>(bytes[0] % 3);
  recordings::LidarMessage message;
  try {
    recordings::decode_lidar_message(kind, Serialisation, bytes.subspan(1), message);
    if (kind != bags::MessageKind::imu) {
      const auto places = bags::point_places(kind, Serialisation, bytes.subspan(1));
      require(places.count == message.points.size(), "points are where they are found");
      for (std::size_t i = 0; i < places.count; ++i) {
        bags::load_point(places, i, bytes.subspan(1));
      }
    }
  } catch (const bags::BadMessage&) {
    return;
  }
  require(message.points.size() <= bytes.size(), "no more points than bytes");
  for (const recordings::MessagePoint& point : message.points) {
    require(std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z),
            "coordinates are numbers");
  }
  if (kind != bags::MessageKind::cloud) return;
  recordings::CloudTimeSearch search;
  search.add(message.cloud, message.time_ns);
  const auto time = search.found();
  if (!time) return;
  std::size_t times = 0;
  recordings::for_each_time(*time, message.cloud, message.time_ns,
                            [&times](std::int64_t) { ++times; });
  require(times == message.points.size(), "a time for each point");
}

/// A message with a pose: the first byte says which, and how it is serialised.
void run_pose_message(std::span<const std::uint8_t> bytes) {
  using bags::MessageKind;
  constexpr std::array kKinds{MessageKind::odometry, MessageKind::pose,
                              MessageKind::pose_with_covariance, MessageKind::transform};
  if (bytes.empty()) return;
  const auto bag = bytes[0] % 2 == 0 ? bags::Serialisation::ros1 : bags::Serialisation::cdr;
  const MessageKind kind = kKinds[bytes[0] / 2 % kKinds.size()];
  try {
    const auto pose = trajectories::decode_ros_pose(bag, kind, bytes.subspan(1));
    require(pose.position.allFinite(), "positions are numbers");
    require(std::abs(pose.attitude.norm() - 1) < 1e-9, "attitudes are of length 1");
    require(pose.frame.size() + pose.body.size() < bytes.size(), "no longer names than bytes");
  } catch (const bags::BadMessage&) {
    return;
  }
}

}  // namespace

std::vector<Target> decoder_targets() {
  return {{"packets", run_packets},
          {"numbered-packets", run_numbered_packets},
          {"ros1-message", run_message<bags::Serialisation::ros1>},
          {"ros2-message", run_message<bags::Serialisation::cdr>},
          {"pose-message", run_pose_message}};
}

}  // namespace risley::fuzz
