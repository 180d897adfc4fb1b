// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "risley/calibration/flight_calibration.hpp"

namespace risley::calibration {

/// A drift of the clock, or an error of a held or known value, is significant beyond this many
/// sigmas.
constexpr double kTestedSigmas = 5;

/// Mount and sensor with the adjusted unknowns. Unknowns and their covariance are known.
/// @param held        [globals]
/// @param considered  number of the last globals: held, and possibly off
void fill_mount_and_sensor(const FlightCalibrationOptions& options, const FlightModel& model,
                           const std::vector<bool>& held, std::size_t considered,
                           FlightCalibration& c);

// Each records whether an assumption fails, and warns if so.

/// @param seconds  between the first shot and the last
void judge_clock_drift(double value, double sigma, double seconds, FlightCalibration& c);
void judge_attitude_delay(double value, double sigma, FlightCalibration& c);
/// An implausible clock offset is an error of something else.
void judge_clock_offset(FlightCalibration& c);
void judge_held(HeldParameter held, const sensors::Sensor& sensor, FlightCalibration& c);

void judge_control(const scenes::KnownGround& ground, SeenControl seen, FlightCalibration& c);

/// Warns of the changes made to the trajectory, and of those that failed.
/// @param begin_ns  origin of the times
void warn_of_trajectory(std::int64_t begin_ns, FlightCalibration& c);

/// The trajectory with its estimated errors.
/// @param sigma  of the corrections
trajectories::Trajectory corrected(const trajectories::Trajectory& trajectory,
                                   const FlightModel& model,
                                   const trajectories::ErrorProcess& process,
                                   const Eigen::MatrixXd& sigma);

}  // namespace risley::calibration
