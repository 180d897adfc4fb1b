// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "risley/estimation/running_estimate.hpp"
#include "risley/jobs/given.hpp"
#include "risley/recordings/livox/packet.hpp"

namespace risley::jobs {

/// A sensor whose optics are watched.
struct WatchedSensor {
  std::string serial;
  std::uint8_t device_type = 0;  ///< as recordings::Device::type
};

/// Current state of a running sensor's optics.
struct OpticsHealth {
  std::string reference;      ///< name of the sensor with the starting values; empty: not watched
  bool is_reference = false;  ///< it ought to be that sensor: RunningOptions::is_sensor
  std::string words;          ///< reason why it is not watched; empty if it is
  estimation::RunningState state;
  std::uint64_t packets = 0;          ///< that the estimate took
  std::uint64_t dropped_packets = 0;  ///< dropped because of overload
};

/// Direction of a shot, for viewers of the scan.
struct SeenShot {
  float azimuth = 0, zenith = 0, range = 0;  ///< as reported, rad and m
};

/// Monitors the optics of sensors as their packets arrive, on a separate thread. The caller that
/// adds packets never waits: packets that exceed the capacity are dropped and counted.
class OpticsWatch {
 public:
  /// Most waiting packets of all sensors together: about two seconds of one.
  static constexpr std::size_t kMostWaiting = 6000;

  /// @param reference preset or calibration file expected for the sensors; one with a serial number
  /// applies only to the sensor of that number. Empty: none. Every other sensor starts from the
  /// preset of its type and is compared only with its own beginning.
  /// @throws FileError, InvalidArgument
  OpticsWatch(const std::vector<WatchedSensor>& sensors, const GivenSensor& reference);
  ~OpticsWatch();  ///< forgets what still waits
  OpticsWatch(const OpticsWatch&) = delete;
  OpticsWatch& operator=(const OpticsWatch&) = delete;

  /// Shot grid of special firmware, before the first packet of a sensor.
  void set_grid(std::size_t sensor, const recordings::livox::ShotGrid& grid);
  /// Takes a packet. @param sensor  its place in the list
  void add(std::size_t sensor, std::span<const std::uint8_t> packet);
  /// Waits until all added packets are processed, or until the time limit: those still waiting are
  /// then dropped and counted.
  /// @param longest  s
  void finish(double longest);
  /// What is known now [sensors].
  std::vector<OpticsHealth> health() const;
  /// A few of the shots with a return since the last call.
  std::vector<SeenShot> take_seen(std::size_t sensor);

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

}  // namespace risley::jobs
