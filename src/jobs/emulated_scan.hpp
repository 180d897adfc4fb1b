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

#include "jobs/recorded_scan.hpp"

namespace risley::jobs {

/// Packets of an endless scan, simulated or recorded.
class EmulatedScan {
 public:
  /// @param recording  path; empty: simulated by the options
  /// @param bend  the changes of bend() to parameters of the true sensor, SI units; not for a
  /// recording
  /// @throws InvalidArgument if Livox has no such type of sensor, and as RecordedScan; FileError
  EmulatedScan(const SimulationOptions& options, const std::string& recording,
               const ParameterValues& bend = {});

  const recordings::Device& device() const { return device_; }  ///< serial number and type

  /// The sensor is of the second generation.
  bool numbered() const { return recordings::is_second_generation(device_.type); }
  /// The sensor starts: packets are numbered from 0, and times are from power-on.
  void begin();
  /// State reported in headers from now on. @param status  Packet::status, of the first generation
  void set_header(recordings::TimeReference source, std::uint32_t status);
  /// Observations of a packet of points.
  std::size_t rows(std::uint8_t data_type) const { return layout_of(data_type).rows(); }
  /// The next packet of points. @param time_ns  of its first shot
  /// @return header and records, until the next call
  std::span<const std::uint8_t> next(std::uint8_t data_type, std::int64_t time_ns);
  /// From now on it has other optics. Its rotors and its noise continue unchanged.
  void bend() { bent_ = true; }
  /// An inertial sample of a sensor at rest.
  std::span<const std::uint8_t> imu(std::int64_t time_ns);
  /// Duration of this many packets of a type, ns.
  std::int64_t time_of(std::uint64_t packets, std::uint8_t data_type) const;
  /// Packets in a time.
  std::uint64_t packets_in(std::int64_t time_ns, std::uint8_t data_type) const;

 private:
  void read_shots();
  void simulate_shot(bool tagged);
  /// Of a packet's period, over the grid's denominator.
  std::uint64_t period_numerator_ns(std::uint8_t data_type) const;
  recordings::livox::RecordLayout layout_of(std::uint8_t data_type) const;
  /// Makes room for its records. @return where they go
  std::uint8_t* begin_packet(std::uint8_t data_type);
  /// Writes the header before them. @return the packet
  std::span<const std::uint8_t> end_packet(std::uint8_t data_type, std::int64_t time_ns);

  simulation::SimulationSettings settings_;
  recordings::livox::ShotGrid grid_;
  recordings::Device device_;
  std::optional<RecordedScan> recorded_;
  std::optional<simulation::SimulationSettings> bent_settings_;
  bool bent_ = false;
  // Unless it is recorded; the second where it can bend.
  std::unique_ptr<simulation::Scanner> scanner_, bent_scanner_;
  recordings::Chunk chunk_, bent_chunk_;
  std::size_t next_shot_ = 0;  // of the chunk
  recordings::Observations record_;
  std::vector<std::uint8_t> packet_;
  recordings::Packet header_;
  std::uint16_t number_ = 0, imu_number_ = 0;  // of the next packets
};

}  // namespace risley::jobs
