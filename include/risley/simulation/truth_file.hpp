// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/sensors/named_values.hpp"
#include "risley/simulation/scanner.hpp"

namespace risley::simulation {

/// Destination of a recording's truth.
std::string truth_preset_path(const std::string& recording);      ///< OUT.truth.yaml
std::string truth_columns_path(const std::string& recording);     ///< OUT.truth.nc
std::string truth_trajectory_path(const std::string& recording);  ///< OUT.trajectory.truth.csv
std::string truth_mount_path(const std::string& recording);       ///< OUT.mount.truth.yaml
std::string strips_path(const std::string& recording);            ///< OUT.strips.yaml
/// OUT.trajectory.csv: the user's version. @param ending which chooses the format
std::string trajectory_path(const std::string& recording, const std::string& ending);

/// All files written by simulate_to_file(), the recording first.
std::vector<std::string> simulation_files(const SimulationSettings& settings,
                                          const std::string& recording);

/// The true sensor, with everything needed to repeat the simulation in its provenance: the given
/// pairs (command, version), seed, start angles, duration, rate, noise, rounding, rotor motion,
/// clock and the parameters that the sensor reports instead of the truth.
sensors::Sensor truth_preset(const Scanner& scanner,
                             const std::vector<std::pair<std::string, std::string>>& provenance);

/// What was written.
struct SimulationResult {
  std::uint64_t observations = 0;
  std::uint64_t no_return = 0;
  sensors::Sensor truth;                         ///< as in OUT.truth.yaml
  std::vector<double> start_angles;              ///< rotation angles at time zero, rad
  std::vector<std::string> files;                ///< all files written, the recording first
  std::vector<std::string> truth_files;          ///< of them, those with the truth
  std::string trajectory;                        ///< the user's; empty for a stationary sensor
  std::vector<trajectories::StripTimes> strips;  ///< of a flight
  /// Parts of the user's trajectory that the format cannot hold, in words.
  std::vector<std::string> left_out;
};

/// Simulates a whole recording and writes it with its truth: OUT in the format given by its ending,
/// OUT.truth.yaml (a sensor preset) and OUT.truth.nc (see recordings::TruthWriter). Memory does not
/// grow with the duration. For a sensor on a platform also OUT.trajectory.truth.csv, the true
/// trajectory; OUT.trajectory.csv (or another ending), the user's, with errors if the platform has
/// a model of them; OUT.mount.truth.yaml; and OUT.strips.yaml if there are strips. A failure leaves
/// none of these.
/// @param provenance  goes into the preset first, e.g. {"command", ...}
/// @throws InvalidArgument for invalid settings or an invalid ending, FileError
SimulationResult simulate_to_file(
    const SimulationSettings& settings, const std::string& path,
    const std::vector<std::pair<std::string, std::string>>& provenance,
    const Progress& progress = {});

/// The true parameters, nonzero range errors, and the rotation angles at the start.
std::vector<sensors::NamedValue> true_values(const SimulationResult& result);

}  // namespace risley::simulation
