// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "risley/recordings/observations.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/truth.hpp"
#include "risley/recordings/writer.hpp"
#include "risley/scenes/scene.hpp"
#include "risley/sensors/sensor.hpp"
#include "risley/simulation/platform.hpp"
#include "risley/simulation/rotor_dynamics.hpp"

namespace risley::simulation {

/// What to simulate. SI units; an empty optional takes the true sensor's own value.
struct SimulationSettings {
  sensors::Sensor truth;  ///< where the beam really goes
  /// The sensor's own optics, when they are wrong: it reports directions from these parameters,
  /// while its beam and its ranges follow the truth. [B21 section 3.3]
  std::optional<sensors::Sensor> reported;

  double duration = 1.0;              ///< s
  std::optional<double> rate;         ///< shots per second
  std::optional<double> angle_noise;  ///< 1 sigma of azimuth and zenith, rad
  std::optional<double> range_noise;  ///< 1 sigma, m
  bool quantize = true;               ///< round to the sensor's resolution, as sensors do

  RotorKind rotor = RotorKind::constant;
  std::optional<RotorSettings> rotor_settings;  ///< replaces the settings of the kind
  /// Rotation angles at time zero, rad, one per prism; empty: uniformly random from the seed.
  std::vector<double> start_angles;

  std::optional<scenes::Scene> scene;  ///< without one there are no ranges
  std::string station;                 ///< of the scene; empty: at its origin, X forward
  /// Motion of the sensor through the scene, instead of a station.
  std::optional<Platform> platform;

  recordings::WriteOptions writing;  ///< options of the recording's format
  std::uint64_t seed = 0;
  int threads = 0;  ///< 0: the caller's number
};

/// A simulated sensor that returns its recording piece by piece, so that memory does not grow with
/// the number of shots. The numbers depend only on the settings without threads, not on the size of
/// the pieces.
///
/// Shot i is fired at round(i 1e9 / rate) ns by emitter i modulo their number, and the truth is
/// that of this rounded time; the clock of a sensor on a platform reads first_clock_reading_ns()
/// more, and its origin is power-on or, with a trajectory in Unix time, UTC. Beams
/// start where they leave the last prism [B21 App. A], and ranges count from there; a sensor whose
/// prism sizes are 0 sends all of them from its origin. A beam that hits nothing, or beyond the
/// sensor's limits of range, has no return: range 0 and valid 0, with its reported direction. A
/// beam that does not get through the prisms has NaN angles too. Without a scene every range is NaN
/// and the header says has_range = false. Intensity is reflectivity times the cosine of incidence
/// on the sensor's scale, where 150 stands for 100 %; ranges do not weaken it. Reported ranges have
/// the true sensor's range_offset and range_errors; those that depend on the intensity use the
/// reported one.
///
/// In a scene with a footprint the true range is still that of the middle of the beam. The reported
/// one is the mean of nine rays of equal energy, spread over the divergences of the sensor and
/// weighted with the received energy, as far as their ranges follow each other within a pulse (0.6
/// m, assumed): the first pulse counts. Its intensity falls with the part of the beam in it. In a
/// scene with limit_by_reflectivity a return needs the value of reflectivity cos(incidence) /
/// range^2 of an 80 % surface that faces the sensor at its range_maximum.
class Scanner {
 public:
  /// @throws InvalidArgument naming setting, value and allowed range
  explicit Scanner(SimulationSettings settings);
  ~Scanner();

  /// The settings, as given.
  const SimulationSettings& settings() const;
  /// The header for readers of the recording.
  const recordings::RecordingHeader& header() const;
  /// Number of shots of the whole recording.
  std::uint64_t shots() const;
  /// Number of shots returned so far.
  std::uint64_t shots_done() const;
  /// Number of shots returned so far without a return.
  std::uint64_t no_return() const;
  /// Rotation angles at time zero, rad.
  const std::vector<double>& start_angles() const;

  /// Replaces both by the next rows, at most max_rows. @return false when there is nothing more
  /// @throws InvalidArgument for max_rows = 0
  bool read(recordings::Chunk& chunk, recordings::TruthColumns& truth,
            std::size_t max_rows = recordings::kDefaultChunkRows);

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace risley::simulation
