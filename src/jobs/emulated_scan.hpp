// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "risley/jobs/simulation_settings.hpp"
#include "risley/recordings/livox/packet.hpp"
#include "risley/simulation/scanner.hpp"

namespace risley::jobs {

/// Packets of a simulated scan, which never ends.
class EmulatedScan {
 public:
  /// @param bend  what bend() adds to parameters of the true sensor, SI units
  /// @throws InvalidArgument where Livox has no such type of sensor; FileError
  explicit EmulatedScan(const SimulationOptions& options, const ParameterValues& bend = {});

  const recordings::Device& device() const { return device_; }  ///< serial number and type

  /// The next packet of points. @param time_ns  of its first shot
  /// @return header and records, until the next call
  std::span<const std::uint8_t> next(std::uint8_t data_type, std::int64_t time_ns);
  /// From now on its optics are others. Its rotors and its noise go on as they would have.
  void bend() { bent_ = true; }
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
  std::optional<simulation::SimulationSettings> bent_settings_;
  bool bent_ = false;
  std::unique_ptr<simulation::Scanner> scanner_, bent_scanner_;  // the second where it can bend
  recordings::Chunk chunk_, bent_chunk_;
  std::size_t next_shot_ = 0;  // of the chunk
  recordings::Observations record_;
  std::vector<std::uint8_t> packet_;
};

}  // namespace risley::jobs
