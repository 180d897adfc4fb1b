// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "risley/recordings/livox/packet.hpp"
#include "risley/recordings/observations.hpp"

namespace risley::recordings::livox {

/// Properties of a sensor that only several of its first packets reveal: the timing of its shots,
/// and its possible type.
class FirstPackets {
 public:
  /// A packet of points. @param rows  its rows are [first_row, first_row + packet.rows)
  void add(const Packet& packet, const Observations& rows, std::size_t first_row);

  bool empty() const { return !last_time_ns_; }          ///< no packet of points was added
  std::uint8_t data_type() const { return data_type_; }  ///< of the last packet
  /// Shortest time between two packets over the records of one, ns; usable after two packets.
  double interval_ns() const;
  /// Grid of its shots: if the type does not imply it, it is judged by the packets' times, and
  /// the Mid-40 firmware that stores several returns as so many records shows it by intensities.
  /// Empty: as device type and data type say. @param device_type  as Device::type
  std::optional<ShotGrid> grid(std::uint8_t device_type) const;
  /// Device::type, as far as data type and times reveal it; otherwise kUnknownDeviceType.
  std::uint8_t device_type() const;

 private:
  std::int64_t shortest_period_ns_ = std::numeric_limits<std::int64_t>::max();
  std::optional<std::int64_t> last_time_ns_;
  std::uint8_t data_type_ = 0;
  // Records of the Mid-40 firmware that stores n returns as n records have intensity 200 (second
  // return) or 250 (third), or are null: counted for n = 2 and 3.
  std::array<std::size_t, 4> fitting_{}, contradicting_{};
};

}  // namespace risley::recordings::livox
