// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/jobs/live_points.hpp"
#include "risley/jobs/optics_watch.hpp"
#include "risley/recordings/livox/packet_order.hpp"
#include "risley/wire/commands.hpp"
#include "risley/wire/control_frame.hpp"
#include "risley/wire/foxglove_server.hpp"

namespace risley::jobs {

/// What to record from the network, and how.
struct RecordOptions {
  std::string interface;             ///< its address; empty: the only one there is
  std::vector<std::string> serials;  ///< broadcast codes of the sensors; empty: all that are found
  double find_time = 2.5;            ///< s, duration of the search for sensors
  bool passive = false;              ///< only listens, on data_port, and sends nothing
  std::uint16_t data_port = 56001;   ///< that of another host that receives the data, in passive
                                     ///< mode
  std::optional<double> duration;    ///< s from the first data on; empty: until it is cancelled
  /// Empty: as the sensors are. Those of the second generation send coordinates otherwise.
  std::optional<bool> spherical = true;
  std::optional<wire::ReturnMode> return_mode;  ///< empty: as the sensors are
  bool imu = true;                              ///< inertial samples, if the sensor has them
  /// Path; ends in .lvx or .lvx2, or in .nc for a conversion at the end. Sensors of the first
  /// generation are written to the .lvx of this name, those of the second to the .lvx2.
  std::string output;
  bool watch_optics = false;                 ///< see OpticsWatch
  GivenSensor optics_reference;              ///< as OpticsWatch's
  std::optional<LivePointsOptions> publish;  ///< points while the sensors run
};

/// A sensor on the interface.
struct FoundSensor {
  std::string serial;  ///< broadcast code; in a passive recording the address if none was received
  std::uint8_t device_type = 0;  ///< as recordings::Device::type
  wire::Address address;
  std::uint16_t command_port = wire::kSensorPort;  ///< at which it listens
};

/// Report of a sensor of the second generation, valid from some time on.
struct RecordedReport {
  double begin = 0;  ///< s since the first data of the recording, by the host's clock
  wire::SensorReport report;
};

/// A period without data of a sensor, by the host's clock; s since the first data of the recording.
struct RecordedGap {
  double begin = 0, end = 0;
  std::optional<std::uint64_t> lost;  ///< as recordings::livox::PacketGap::lost
  bool imu = false;                   ///< of inertial samples, not of points
  recordings::livox::GapCause cause = recordings::livox::GapCause::loss;
};

/// A period in which the clock of a sensor neither jumped nor changed its source; s since the first
/// data of the recording, by the host's clock.
struct RecordedClock {
  recordings::TimeReference source = recordings::TimeReference::power_on;
  double begin = 0, end = 0;
  /// Sensor's time less the host's, s, of the packets with the least delay in every second.
  double least_offset = 0, greatest_offset = 0;
  std::optional<recordings::livox::ClockDrift> drift;  ///< empty if it was too short
};

/// A status that a sensor reports from some time on: recordings::Packet::status.
struct RecordedStatus {
  double begin = 0;  ///< s since the first data of the recording, by the host's clock
  std::uint32_t status = 0;
};

/// What was recorded of a sensor.
struct RecordedSensor {
  FoundSensor sensor;
  std::string firmware;                    ///< empty if the sensor reports none
  recordings::livox::PacketCounts counts;  ///< without those of strangers
  std::uint64_t kernel_drops = 0;
  std::uint64_t rejected = 0;  ///< datagrams that were not packets, or from another sender
  std::uint64_t sessions = 0;  ///< handshakes that were answered
  std::vector<RecordedGap> gaps;
  /// Warnings and errors of the sensor itself, each status once: recordings::Packet::status.
  std::vector<std::uint32_t> statuses;
  std::vector<RecordedClock> clocks;           ///< one after the other, the first 100
  std::vector<RecordedStatus> status_changes;  ///< as packets have them, the first 1000
  std::vector<RecordedReport> reports;         ///< changes except for the temperature, the first
                                               ///< 1000
  /// Temperatures that the sensor reported, deg C; empty if it reported none.
  std::optional<double> coldest, warmest;
  std::size_t file = 0;                      ///< that it is in: RecordedSensors::files
  std::optional<OpticsHealth> optics;        ///< where they were watched
  std::optional<PublishedPoints> published;  ///< where they were
};

/// What came of a recording.
struct RecordedSensors {
  /// A file that was written.
  struct File {
    std::string path;
    std::uint64_t frames = 0, bytes = 0;
  };
  std::vector<File> files;  ///< of the first generation, of the second; those that exist
  wire::Address interface;
  double duration = 0;  ///< s from the first data to the end
  std::size_t receive_buffer_asked = 0, receive_buffer_granted = 0;  ///< bytes per sensor
  std::vector<RecordedSensor> sensors;
  std::uint64_t strangers = 0;  ///< datagrams at the broadcast port that name no sensor
  /// Viewers of the points, as reported by the server.
  std::optional<wire::FoxgloveCounts> viewers = {};
};

/// A sensor while it is recorded.
struct LiveSensorState {
  FoundSensor sensor;
  recordings::livox::PacketCounts counts;  ///< so far
  std::uint64_t kernel_drops = 0, rejected = 0;
  bool silent = false;                  ///< nothing came for a second
  std::optional<std::uint32_t> status;  ///< the last one, as recordings::Packet::status
  /// The last one, of the second generation.
  std::optional<wire::SensorReport> report;
  std::optional<OpticsHealth> optics;        ///< where they are watched
  std::optional<PublishedPoints> published;  ///< where they are
  std::vector<SeenShot> seen;  ///< a few of the shots since the last call, for viewers
};

/// A recording while it runs.
struct LiveRecording {
  double duration = 0;  ///< s since the first data
  bool over = false;    ///< this is the last report
  std::vector<LiveSensorState> sensors;
};

/// Called twice a second, and at the end. The recording waits for it, so it must be fast.
using RecordWatch = std::function<void(const LiveRecording&)>;

/// Called at once with a message about a sensor, and whether it is a problem.
using RecordNote = std::function<void(const std::string& words, bool is_wrong)>;

/// Sensors that broadcast on the interface, or answer a search of the second generation, by serial
/// number. Sends no commands.
/// @throws InvalidArgument, NetworkError, Cancelled
std::vector<FoundSensor> find_sensors(const RecordOptions& options, const Progress& progress = {});

/// Finds sensors of both generations, starts them, and writes their packets to one LVX 1.1 and one
/// LVX 2 file as they arrive, see recordings::livox::PacketFile, also if that is converted to
/// NetCDF at the end, which can be of one generation only. It runs until the time is over or the
/// progress is cancelled: that is the clean end of a recording, for which the sensors are stopped.
/// A sensor that falls silent is reported, and continues in the same file when it returns; one that
/// is found later than the others is not recorded: the table of sensors stands before the data.
/// @throws InvalidArgument; NetworkError also if there is no sensor, or none sends anything;
/// FileError
RecordedSensors record_sensors(const RecordOptions& options, const RecordNote& note,
                               const Progress& progress = {}, const RecordWatch& watch = {});

/// An alarm in a sentence, such as "prism_tilt_b_vertical_deg has changed by ...".
std::string alarm_words(const OpticsHealth& health);

}  // namespace risley::jobs
