// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/network_unit.hpp"

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/recordings/livox/numbered_packet.hpp"

namespace risley::jobs {

SensorOfUnit sensor_of_unit(const WatchedSensor& unit, const std::optional<sensors::Sensor>& given,
                            const std::string& name) {
  if (!given || (!given->serial.empty() && given->serial != unit.serial)) {
    return {preset_of_type(unit.device_type), false};
  }
  if (given->device_type != unit.device_type) {
    throw InvalidArgument(
        fmt::format("{}: it is a {}, and the sensor {} on the network is a {}; name another", name,
                    recordings::device_type_name(static_cast<std::uint8_t>(given->device_type)),
                    unit.serial, recordings::device_type_name(unit.device_type)));
  }
  return {given, true};
}

bool UnitPackets::decode(std::span<const std::uint8_t> packet, recordings::Chunk& chunk) {
  using namespace recordings::livox;
  if (recordings::is_second_generation(device_type_)) {
    const NumberedHeader header = decode_numbered_header(packet);
    if (header.data_type == kNumberedImu) return false;
    cartesian_ = numbered_layout(header.data_type, header.records)->cartesian;
    time_reference_ = numbered_time_reference(header.time_type);
    decode_numbered_packet(packet, device_type_, 0, chunk);
    return true;
  }
  const recordings::Packet header = decode_packet_header(packet);
  if (header.data_type == kImuDataType) return false;
  if (!decoder_) {
    PacketDecoderOptions options;
    options.device_type = device_type_;
    options.grid = grid_;
    decoder_.emplace(options);
  }
  decoder_->decode(packet, chunk);
  cartesian_ = record_layout(header.data_type)->cartesian;
  time_reference_ = time_reference_of(header.timestamp_type);
  return true;
}

}  // namespace risley::jobs
