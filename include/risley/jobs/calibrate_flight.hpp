// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "risley/calibration/flight_calibration.hpp"
#include "risley/core/progress.hpp"
#include "risley/jobs/beam_comparison.hpp"
#include "risley/jobs/flight_details.hpp"
#include "risley/jobs/moving_platform.hpp"
#include "risley/jobs/ranged_input.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/trajectories/error_process.hpp"
#include "risley/trajectories/flown_strips.hpp"
#include "risley/trajectories/mount.hpp"

namespace risley::jobs {

struct CalibratedFlight;

/// Input and settings of a calibration in flight. SI units. A calibration given as the sensor, for
/// example from walls, contributes its covariance.
struct CalibrateFlightOptions : RangedInputOptions {  ///< recordings of one flight
  PlatformFiles platform;                             ///< trajectory and mount; no map
  HeldParameters fixed;
  std::vector<std::string> additional;  ///< further parameters to free
  /// As calibration::FlightCalibrationOptions has them.
  std::optional<double> range_noise, prior_sigma;
  double range_offset_sigma = calibration::FlightCalibrationOptions{}.range_offset_sigma;
  std::optional<double> tolerance;  ///< of directions, rad
  double knot_spacing = calibration::FlightCalibrationOptions{}.knot_spacing;
  double cell_size = calibration::FlightCalibrationOptions{}.cell_size;
  std::uint64_t seed = 0;
  /// Path of known ground, see scenes::load_control; may be empty. It fixes the flight's position.
  std::string control;
  std::vector<std::string> truths;  ///< OUT.truth.yaml of each recording to compare with, or none
  bool details = false;             ///< wanted in the result
  bool force = false;  ///< also write a result that is no better, or that a drifting clock has
                       ///< spoilt
  /// Names the outputs: calibration.yaml, mount.yaml and trajectory.csv; without them nothing is
  /// written.
  ResultFiles files;
  /// Further files of the folder, such as a page, made from the result.
  std::function<std::vector<NamedText>(const CalibratedFlight&)> texts;
};

/// What came of it.
struct CalibratedFlight : RangedInput {
  trajectories::Mount mount;        ///< as it was given
  trajectories::ErrorModel errors;  ///< of the trajectory
  std::vector<trajectories::FlownStrip> strips;
  std::vector<std::size_t> strip_rows;  ///< shots of every strip
  std::size_t outside_strips = 0;       ///< shots between them
  calibration::FlightCalibration calibration;
  std::optional<FlightTruth> truth;      ///< where it is known
  std::optional<FlightDetails> details;  ///< where they were asked for
  bool calibration_written = false;      ///< calibration.yaml, and its companions
  Provenance provenance;    ///< of the options, with the inputs; empty if nothing was written
  double solving_time = 0;  ///< s
  double total_time = 0;    ///< of the job, s
};

/// Finds the rotation angles of every recording and calibrates mount and sensor on the strips of
/// the flight. Stages, for each recording: reading, rotation angles; then calibrating.
/// @throws EstimationError when recordings and trajectory share no time, for fewer than two strips
/// that overlap; InvalidArgument, also for a recording given twice and if the trajectory's errors
/// are not stated, and for known ground on a map if the trajectory has none or vice versa;
/// FileError; Cancelled
CalibratedFlight calibrate_flight(const CalibrateFlightOptions& options,
                                  const Progress& progress = {});

}  // namespace risley::jobs
