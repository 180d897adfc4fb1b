// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "risley/core/progress.hpp"
#include "risley/jobs/simulation_settings.hpp"
#include "risley/recordings/observations.hpp"
#include "risley/wire/address.hpp"

namespace risley::jobs {

/// Faults of a virtual sensor's transmission, on request. Shares are of packets, [0, 1].
struct EmulatedFaults {
  double loss = 0;         ///< share that is never sent
  double duplication = 0;  ///< share that is sent twice
  double disorder = 0;     ///< share that others overtake
  int farthest = 10;       ///< most packets that overtake one
  double delay = 0;        ///< s, by which data come late
  /// Share of frames, replies and broadcasts with a wrong last byte.
  double wrong_checksums = 0;
  std::optional<double>
      heartbeat_dies;             ///< s after the first start; from then to the session's end
  std::optional<double> restart;  ///< s after the first start, once
  double restart_time = 2;        ///< s, silence of a sensor that restarts
  /// Changes of parameters of the true sensor, SI units, while the rotors continue.
  ParameterValues bend;
  std::optional<double> bend_time;  ///< s after the first start, once
};

/// Behaviour of the clock of a virtual sensor. Times are s after the first start.
struct EmulatedClock {
  /// Of its times: power_on; ptp, this machine's time; or pps, which begins again every second.
  recordings::TimeReference source = recordings::TimeReference::power_on;
  double source_from = 0;      ///< before, its times are from power-on
  double drift_ppm = 0;        ///< its excess over this machine's rate, (-10000, 10000)
  std::optional<double> jump;  ///< once, at this time
  double jump_by = 0.25;       ///< s, [-3600, 3600]
};

/// Type and behaviour of the virtual sensor.
struct EmulateOptions {
  std::string interface;  ///< address of the sensor, one of this machine
  std::string serial;     ///< broadcast code; empty: that of the simulation
  /// Its surroundings; without a scene the inside of a room. The shot rate is that of the sensor's
  /// type; the duration and the motion are ignored.
  SimulationOptions simulation;
  /// Path of a recording of one sensor, whose shots are sent instead, with its gaps and all their
  /// returns, in a loop. simulation.sensor gives its type if the file does not.
  std::string recording;
  double speed = 1;                ///< times faster than real time
  std::optional<double> duration;  ///< s from the beginning; empty: until it is cancelled
  EmulatedClock clock;
  EmulatedFaults faults;
};

/// The truth of a virtual sensor's output.
struct EmulatedSensor {
  std::string serial;
  std::uint8_t device_type = 0;  ///< as recordings::Device::type
  wire::Address address;
  double duration = 0;                                   ///< s of real time
  std::uint64_t packets = 0, rows = 0, imu_samples = 0;  ///< that were sent, each once
  /// Packets not sent between others that were, in one session.
  std::uint64_t lost = 0;
  std::uint64_t lost_at_ends = 0;  ///< not sent before the first or after the last of a session
  std::uint64_t unsent = 0;        ///< of both: dropped by the kernel
  std::uint64_t duplicates = 0, reordered = 0;  ///< sent twice; overtaken
  std::uint64_t wrong_checksums = 0;            ///< frames that were damaged
  std::uint64_t kernel_drops = 0;               ///< of commands
  std::uint64_t rejected = 0;                   ///< datagrams that were not commands of the host
  std::uint64_t sessions = 0, restarts = 0;     ///< handshakes that were answered; restarts
  std::uint64_t clock_jumps = 0;                ///< requested ones, including changes of the source
  std::uint64_t bends = 0;                      ///< times that the optics changed
  double behind = 0;                            ///< s, largest delay of the sending
};

/// Called at once with the sensor's address and state.
using EmulateNote = std::function<void(const std::string& words)>;

/// Emulates a sensor until the time is over or the progress is cancelled, which is its usual end.
/// @throws InvalidArgument, FileError, NetworkError
EmulatedSensor emulate_sensor(const EmulateOptions& options, const EmulateNote& note,
                              const Progress& progress = {});

}  // namespace risley::jobs
