// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "risley/jobs/sensor_choice.hpp"
#include "risley/simulation/scanner.hpp"

namespace risley::jobs {

/// Parameters by name with values in SI units.
using ParameterValues = std::vector<std::pair<std::string, double>>;

/// A simulation, described by files and names. SI units; an empty optional takes the sensor's own
/// value.
struct SimulationOptions {
  GivenSensor sensor = kUsualSensor;  ///< as load_result()
  ParameterValues set;                ///< of the true sensor
  bool reported_nominal = false;      ///< the sensor assumes that it has no errors
  ParameterValues reported;           ///< parameters that it believes in addition, if they differ
                                      ///< from the truth
  /// Length, s; empty: 1, or to the trajectory's end.
  std::optional<double> duration;
  std::optional<double> rate, angle_noise, range_noise;
  bool quantize = true;
  bool beam_origin = true;  ///< beams start where they leave the last prism
  simulation::RotorKind rotor = simulation::RotorKind::constant;
  std::vector<double> start_angles;  ///< of the rotors at time zero, rad; empty: random
  std::string scene;                 ///< path of planes or terrain; empty: no ranges
  std::string station;               ///< of the scene
  // Of a sensor that moves. Paths, where they are texts.
  GivenTrajectory trajectory;  ///< along which it truly moves
  std::string topic;           ///< of its poses, of a bag that has several
  std::string flight;          ///< a plan for the trajectory instead
  GivenMount mount;
  std::string trajectory_errors;           ///< of the trajectory that is written for users
  std::string trajectory_ending = ".csv";  ///< which chooses its format
  std::optional<double> start;        ///< of the recording after the trajectory's first record, s
  std::optional<double> clock_drift;  ///< s/s, see simulation::Platform
  std::uint64_t seed = 0;
  int threads = 0;  ///< 0: all cores
};

/// Settings for simulation::simulate_to_file(), from the files that the options name.
/// @throws InvalidArgument for unknown parameters and values out of bounds, rotation angles among
///         them, and for options that do not go together; FileError
simulation::SimulationSettings simulation_settings(const SimulationOptions& options);

}  // namespace risley::jobs
