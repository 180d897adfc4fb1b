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

/// What is known of the optics of a sensor that runs.
struct OpticsHealth {
  std::string reference;  ///< name of the sensor whose values it starts from; empty: not watched
  bool is_reference = false;  ///< it ought to be that sensor: RunningOptions::is_sensor
  std::string words;          ///< why it is not watched; empty if it is
  estimation::RunningState state;
  std::uint64_t packets = 0;          ///< that the estimate took
  std::uint64_t dropped_packets = 0;  ///< for which it was too slow
};

/// Follows the optics of sensors while their packets come, on a thread of its own. Whoever gives it
/// packets never waits for it: what it is too slow for is dropped and counted.
class OpticsWatch {
 public:
  /// Packets of all sensors together that wait to be looked at: about two seconds of one.
  static constexpr std::size_t kMostWaiting = 6000;

  /// @param reference  preset or calibration file that the sensors ought to be; one with a serial
  ///                   number is for the sensor of that number alone. Empty: none. Every other
  ///                   sensor starts from the preset of its type and is compared with its own
  ///                   beginning only.
  /// @throws FileError, InvalidArgument
  OpticsWatch(const std::vector<WatchedSensor>& sensors, const GivenSensor& reference);
  ~OpticsWatch();  ///< forgets what still waits
  OpticsWatch(const OpticsWatch&) = delete;
  OpticsWatch& operator=(const OpticsWatch&) = delete;

  /// How special firmware measures, before the first packet of a sensor.
  void set_grid(std::size_t sensor, const recordings::livox::ShotGrid& grid);
  /// Takes a packet. @param sensor  its place in the list
  void add(std::size_t sensor, std::span<const std::uint8_t> packet);
  /// Waits until all that was added has been looked at, or the time is over: what waits then is
  /// dropped and counted.
  /// @param longest  s
  void finish(double longest);
  /// What is known now [sensors].
  std::vector<OpticsHealth> health() const;

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

}  // namespace risley::jobs
