// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "risley/jobs/simulation_settings.hpp"
#include "risley/recordings/livox/packet.hpp"
#include "risley/simulation/scanner.hpp"

namespace risley::jobs {

/// Packets of a simulated scan, which never ends.
class EmulatedScan {
 public:
  /// @throws InvalidArgument where Livox has no such type of sensor; FileError
  explicit EmulatedScan(const SimulationOptions& options);

  const recordings::Device& device() const { return device_; }  ///< serial number and type

  /// The next packet of points. @param time_ns  of its first shot
  /// @return header and records, until the next call
  std::span<const std::uint8_t> next(std::uint8_t data_type, std::int64_t time_ns);
  /// An inertial sample of a sensor at rest.
  std::span<const std::uint8_t> imu(std::int64_t time_ns);
  /// Time of so many packets of a type, ns.
  std::int64_t time_of(std::uint64_t packets, std::uint8_t data_type) const;
  /// Packets in a time.
  std::uint64_t packets_in(std::int64_t time_ns, std::uint8_t data_type) const;

 private:
  void read_shots();
  /// Of a packet's period, over the grid's denominator.
  std::uint64_t period_numerator_ns(std::uint8_t data_type) const;
  void begin_packet(std::uint8_t data_type, std::int64_t time_ns);

  simulation::SimulationSettings settings_;
  recordings::livox::ShotGrid grid_;
  recordings::Device device_;
  std::unique_ptr<simulation::Scanner> scanner_;
  recordings::Chunk chunk_;
  recordings::TruthColumns truth_;
  std::size_t next_shot_ = 0;  // of the chunk
  recordings::Observations record_;
  std::vector<std::uint8_t> packet_;
};

}  // namespace risley::jobs
