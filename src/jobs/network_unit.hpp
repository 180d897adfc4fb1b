// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "risley/jobs/optics_watch.hpp"
#include "risley/recordings/livox/packet_decoder.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// Reason why nothing is known about a unit if its type has no preset.
inline constexpr const char* kNoPreset = "there is no preset for its type";

/// Identity assumed for a unit on the network.
struct SensorOfUnit {
  std::optional<sensors::Sensor> sensor;  ///< empty if its type has no preset
  bool is_given = false;                  ///< it is the given one, not a preset
};

/// A unit is the given sensor, unless that has another serial number.
/// @param name  of what was given
/// @throws InvalidArgument for one of another type
SensorOfUnit sensor_of_unit(const WatchedSensor& unit, const std::optional<sensors::Sensor>& given,
                            const std::string& name);

/// Decodes the packets of a unit of either generation, in the order in which they come.
class UnitPackets {
 public:
  explicit UnitPackets(std::uint8_t device_type) : device_type_(device_type) {}

  /// How special firmware measures. Settings after the first packet are ignored.
  void set_grid(const recordings::livox::ShotGrid& grid) { grid_ = grid; }
  /// Appends the rows of a packet. @return whether it holds points
  /// @throws recordings::livox::BadPacket
  bool decode(std::span<const std::uint8_t> packet, recordings::Chunk& chunk);
  /// The last packet of points holds coordinates, not angles.
  bool cartesian() const { return cartesian_; }
  /// What its times count from.
  recordings::TimeReference time_reference() const { return time_reference_; }

 private:
  std::uint8_t device_type_;
  std::optional<recordings::livox::ShotGrid> grid_;
  std::optional<recordings::livox::PacketDecoder> decoder_;  ///< of the first generation
  bool cartesian_ = false;
  recordings::TimeReference time_reference_{};
};

}  // namespace risley::jobs
