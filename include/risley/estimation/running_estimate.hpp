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

/// Settings for monitoring the optics of a running sensor.
struct RunningOptions {
  sensors::Sensor sensor;  ///< start values and held parameters, as EstimateOptions::sensor
  /// The unit should match the sensor within the sensor's sigmas and covariance: otherwise there is
  /// another alarm.
  bool is_sensor = false;
  bool cartesian = false;  ///< as EstimateOptions::cartesian
  double piece = 0.5;      ///< s, after which there is a new estimate
  /// Shots per second used, evenly thinned; others are only counted. No sensor has more.
  double most_rate = 250'000;
  std::size_t beginning = 8;  ///< pieces that it is compared with at first; others join, up to 60
  /// Upper bound for all alarms together without a change of the optics.
  double false_alarms_per_hour = 1e-3;
};

/// What an alarm is about.
enum class OpticsAlarmKind : std::uint8_t {
  changed,  ///< the optics differ from those of the beginning
  unlike,   ///< the optics differ from the sensor's
};
/// "changed" or "unlike"
const char* to_string(OpticsAlarmKind kind);

/// A parameter of the optics over the last pieces, SI units.
struct RunningParameter {
  std::string name;
  double value = 0;
  double sigma = 0;             ///< including possible errors of held parameters
  double sigma_given_held = 0;  ///< if they were exact
  double change = 0;            ///< since the beginning; 0 before it is over
  double change_sigma = 0;      ///< without those of held parameters, which were the same
  double off_sensor = 0;        ///< from the sensor's value
  double off_sensor_sigma = 0;  ///< with the sensor's own uncertainty
};

/// The mean speed of a rotor over the last piece, rad/s.
struct RunningSpeed {
  double value = 0, sigma = 0;
};

/// The optics have changed, or belong to another sensor.
struct OpticsAlarm {
  OpticsAlarmKind kind = OpticsAlarmKind::changed;
  std::int64_t time_ns = 0;          ///< of the last shot processed, by the sensor's clock
  double time = 0;                   ///< the same, s of processed shots
  double p_value = 1;                ///< probability of such a difference by chance
  std::string parameter;             ///< the parameter that alone explains the difference best
  double difference = 0, sigma = 0;  ///< of the last piece, if all others are the same; SI units
};

/// Current results for a running sensor.
struct RunningState {
  /// Where it stands.
  enum class Phase : std::uint8_t {
    waiting,    ///< no piece could be estimated yet
    beginning,  ///< the reference of the comparison is being estimated
    watching,
  };
  Phase phase = Phase::waiting;
  std::vector<RunningParameter> parameters;  ///< empty while it waits
  std::vector<RunningSpeed> speeds;          ///< [prisms]; empty while it waits
  std::optional<int> combination;            ///< as Sensor::combination
  double angle_noise = 0;                    ///< 1 sigma of the last piece, before rounding, rad
  double window = 0;                         ///< s of shots used for the parameters
  std::int64_t time_ns = 0;                  ///< of the last shot of the last piece
  std::uint64_t shots = 0;                   ///< with a direction
  std::uint64_t pieces = 0;                  ///< that were estimated
  std::uint64_t short_pieces = 0;            ///< with too few shots, or cut off by a gap
  std::uint64_t unfit_pieces = 0;            ///< whose shots do not fit the model, or not converged
  std::uint64_t unfit_in_a_row = 0;
  std::string reason;                  ///< reason why the last piece gave no estimate; empty if it
                                       ///< did
  double change_p_value = 1;           ///< least of the last look
  double unlike_p_value = 1;           ///< the same against the sensor
  double alarm_p_value = 0;            ///< a look alarms below
  double scatter_variance_factor = 1;  ///< of the beginning's pieces, never below 1
  bool alarmed = false;                ///< according to the last two checks
  std::optional<OpticsAlarm> alarm;    ///< the first one
  std::uint64_t alarms = 0;            ///< times that it came up
};

/// "waiting", "beginning", "watching"
const char* to_string(RunningState::Phase phase);

/// Monitors the optics of one sensor as its shots arrive, with constant memory. Every piece of the
/// recording is estimated separately, as by run_batch_map(); pieces without an estimate are
/// skipped. The last one, two, four and eight are compared with the beginning, all parameters
/// together and each separately; false alarms are shared among all checks: docs/theory/watch.md.
/// Not thread-safe.
class RunningEstimate {
 public:
  /// @throws InvalidArgument
  explicit RunningEstimate(RunningOptions options);
  ~RunningEstimate();
  RunningEstimate(RunningEstimate&&) noexcept;
  RunningEstimate& operator=(RunningEstimate&&) noexcept;

  /// Takes the next rows of the recording: of one sensor, in the order of their times. Rows without
  /// a direction and further returns of a shot are ignored. A step back or a gap ends a piece.
  /// @return whether there was a new piece  @throws Cancelled
  bool add(const recordings::Observations& rows, const Progress& progress = {});

  const RunningState& state() const;      ///< after the last piece
  const RunningOptions& options() const;  ///< as they were given

 private:
  class Watcher;
  std::unique_ptr<Watcher> watcher_;
};

}  // namespace risley::estimation
