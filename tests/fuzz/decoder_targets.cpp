// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What stands inside files and streams, given to its decoder without them.
#include <algorithm>
#include <cmath>

#include "risley/recordings/livox/packet_decoder.hpp"

#include "fuzz/invariants.hpp"
#include "fuzz/targets.hpp"
#include "recordings/formats/ros1_message.hpp"
#include "recordings/formats/ros2_message.hpp"

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

/// A message of each kind: the first byte says which.
template <void (*decode)(recordings::MessageKind, std::span<const std::uint8_t>,
                         recordings::BagMessage&)>
void run_message(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;
  const auto kind = static_cast<recordings::MessageKind>(bytes[0] % 3);
  recordings::BagMessage message;
  try {
    decode(kind, bytes.subspan(1), message);
  } catch (const recordings::BadMessage&) {
    return;
  }
  require(message.points.size() <= bytes.size(), "no more points than bytes");
  for (const recordings::MessagePoint& point : message.points) {
    require(std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z),
            "coordinates are numbers");
  }
}

}  // namespace

std::vector<Target> decoder_targets() {
  return {{"packets", run_packets},
          {"ros1-message", run_message<recordings::decode_ros1_message>},
          {"ros2-message", run_message<recordings::decode_ros2_message>}};
}

}  // namespace risley::fuzz
