// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/recordings/observations.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// How the optics of a sensor are followed while it runs.
struct RunningOptions {
  sensors::Sensor sensor;  ///< start values and what is held, as EstimateOptions::sensor
  /// The unit ought to be the sensor, to what the sensor's sigmas and covariance say: another alarm
  /// where it is not.
  bool is_sensor = false;
  bool cartesian = false;  ///< as EstimateOptions::cartesian
  double piece = 0.5;      ///< s, after which there is a new estimate
  /// Shots of a second that are used, evenly thinned; others only count. No sensor has more.
  double most_rate = 250'000;
  std::size_t beginning = 8;  ///< pieces that it is compared with at first; others join, up to 60
  /// Of all alarms together, where optics do not change: a bound.
  double false_alarms_per_hour = 1e-3;
};

/// What an alarm is about.
enum class OpticsAlarmKind : std::uint8_t {
  changed,  ///< the optics are no longer those of the beginning
  unlike,   ///< the optics are not those of the sensor
};
/// "changed" or "unlike"
const char* to_string(OpticsAlarmKind kind);

/// A parameter of the optics over the last pieces, SI units.
struct RunningParameter {
  std::string name;
  double value = 0;
  double sigma = 0;             ///< what held parameters may be off by included
  double sigma_given_held = 0;  ///< if they were exactly as held
  double change = 0;            ///< since the beginning; 0 before it is over
  double change_sigma = 0;      ///< held parameters do not count, which were the same
  double off_sensor = 0;        ///< from the sensor's value
  double off_sensor_sigma = 0;  ///< with what the sensor says of its own
};

/// The mean speed of a rotor over the last piece, rad/s.
struct RunningSpeed {
  double value = 0, sigma = 0;
};

/// The optics have changed, or are others.
struct OpticsAlarm {
  OpticsAlarmKind kind = OpticsAlarmKind::changed;
  std::int64_t time_ns = 0;          ///< of the last shot that was looked at, by the sensor's clock
  double time = 0;                   ///< the same, s of shots that were looked at before
  double p_value = 1;                ///< probability of such a difference by chance
  std::string parameter;             ///< whose difference alone would explain it best
  double difference = 0, sigma = 0;  ///< of the last piece, if all others are the same; SI units
};

/// What is known of a sensor that runs.
struct RunningState {
  /// Where it stands.
  enum class Phase : std::uint8_t {
    waiting,    ///< no piece could be estimated yet
    beginning,  ///< what the unit is compared with is being estimated
    watching,
  };
  Phase phase = Phase::waiting;
  std::vector<RunningParameter> parameters;  ///< empty while it waits
  std::vector<RunningSpeed> speeds;          ///< [prisms]; empty while it waits
  std::optional<int> combination;            ///< as Sensor::combination
  double angle_noise = 0;                    ///< 1 sigma of the last piece, before rounding, rad
  double window = 0;                         ///< s of shots that the parameters come from
  std::int64_t time_ns = 0;                  ///< of the last shot of the last piece
  std::uint64_t shots = 0;                   ///< with a direction
  std::uint64_t pieces = 0;                  ///< that were estimated
  std::uint64_t short_pieces = 0;            ///< with too few shots, or cut off by a gap
  std::uint64_t unfit_pieces = 0;  ///< whose shots the model does not describe, or not settled
  std::uint64_t unfit_in_a_row = 0;
  std::string reason;                  ///< why the last piece gave no estimate; empty if it did
  double change_p_value = 1;           ///< least of the last look
  double unlike_p_value = 1;           ///< the same against the sensor
  double alarm_p_value = 0;            ///< a look alarms below
  double scatter_variance_factor = 1;  ///< of the beginning's pieces, never below 1
  bool alarmed = false;                ///< so say the last two looks
  std::optional<OpticsAlarm> alarm;    ///< the first one
  std::uint64_t alarms = 0;            ///< times that it came up
};

/// "waiting", "beginning", "watching"
const char* to_string(RunningState::Phase phase);

/// Follows the optics of one sensor while its shots come in, with constant memory. Every piece of
/// the recording is estimated by itself, as run_batch_map() does; pieces that cannot be estimated
/// are left out. The last one, two, four and eight are compared with the beginning, all parameters
/// together and each by itself; false alarms are shared among all looks: docs/theory/watch.md. Not
/// for several threads at once.
class RunningEstimate {
 public:
  /// @throws InvalidArgument
  explicit RunningEstimate(RunningOptions options);
  ~RunningEstimate();
  RunningEstimate(RunningEstimate&&) noexcept;
  RunningEstimate& operator=(RunningEstimate&&) noexcept;

  /// Takes the next rows of the recording: of one sensor, in the order of their times. Rows without
  /// a direction and further returns of a shot do not count. A step back or a gap ends a piece.
  /// @return whether there was a new piece  @throws Cancelled
  bool add(const recordings::Observations& rows, const Progress& progress = {});

  const RunningState& state() const;      ///< after the last piece
  const RunningOptions& options() const;  ///< as they were given

 private:
  class Watcher;
  std::unique_ptr<Watcher> watcher_;
};

}  // namespace risley::estimation
