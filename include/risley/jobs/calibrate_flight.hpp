// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "risley/calibration/datum.hpp"
#include "risley/calibration/flight_calibration.hpp"
#include "risley/core/progress.hpp"
#include "risley/jobs/calibrate_recordings.hpp"
#include "risley/jobs/flight_details.hpp"
#include "risley/jobs/moving_platform.hpp"
#include "risley/jobs/recording_input.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/trajectories/flown_strips.hpp"

namespace risley::jobs {

struct CalibratedFlight;

/// What to calibrate in flight, and how. SI units.
struct CalibrateFlightOptions {
  std::vector<std::string> recordings;  ///< paths; of one sensor in one flight, with ranges
  recordings::ReadOptions reading;      ///< see open_in_sensor_frame()
  PlatformFiles platform;               ///< trajectory and mount; no map
  /// As given_sensor(). A calibration, from walls say, counts with its covariance.
  std::string sensor;
  std::optional<double> rate;           ///< shots per second to use; empty: all
  std::optional<double> angle_noise;    ///< as estimation::EstimateOptions
  std::optional<bool> mirrored;         ///< the elevation's sign is turned; empty: find out
  std::vector<std::string> fixed;       ///< parameters to hold
  std::vector<std::string> additional;  ///< further parameters to free
  /// As calibration::FlightCalibrationOptions has them.
  std::optional<double> range_noise, prior_sigma;
  double range_offset_sigma = calibration::FlightCalibrationOptions{}.range_offset_sigma;
  double knot_spacing = calibration::FlightCalibrationOptions{}.knot_spacing;
  double cell_size = calibration::FlightCalibrationOptions{}.cell_size;
  std::uint64_t seed = 0;
  std::vector<std::string> truths;  ///< OUT.truth.yaml of each recording to judge by, or none
  bool details = false;             ///< wanted in the result
  bool force = false;               ///< write a calibration that is not better, too
  /// Names the outputs: calibration.yaml, mount.yaml and trajectory.csv; without them nothing is
  /// written.
  ResultFiles files;
  /// Further files of the folder, such as a page, made from the result.
  std::function<std::vector<NamedText>(const CalibratedFlight&)> texts;
};

/// Where the beams of a moving sensor were thought to go, against where they went.
struct FlightTruth {
  /// Of boresight and prisms together, sensor axes.
  calibration::DirectionErrors before, after;
  sensors::Sensor sensor;     ///< true
  trajectories::Mount mount;  ///< true
};

/// What came of it.
struct CalibratedFlight {
  std::vector<ReadRecording> recordings;
  std::uint64_t observations = 0;     ///< rows of all recordings
  std::vector<std::string> warnings;  ///< of recordings and trajectory; the calibration has its own
  SensorChoice choice;                ///< who says which sensor the first one was
  sensors::Sensor nominal;            ///< preset that all started from
  trajectories::Mount mount;          ///< as it was given
  trajectories::ErrorModel errors;    ///< of the trajectory
  std::vector<trajectories::FlownStrip> strips;
  std::vector<std::size_t> strip_rows;  ///< shots of every strip
  std::size_t outside_strips = 0;       ///< shots between them
  calibration::FlightCalibration calibration;
  std::optional<FlightTruth> truth;      ///< where it is known
  std::optional<FlightDetails> details;  ///< where they were asked for
  Provenance provenance;  ///< of the options, with the inputs; empty where nothing was written
  double reading_time = 0, angles_time = 0, solving_time = 0;  ///< s
};

/// Finds the rotation angles of every recording and calibrates mount and sensor on the strips of
/// the flight. Stages, for each recording: reading, rotation angles; then calibrating.
/// @throws EstimationError when recordings and trajectory share no time, for fewer than two strips
///         that overlap; InvalidArgument, also for a recording that is given twice and where
///         nothing says how wrong the trajectory may be; FileError; Cancelled
CalibratedFlight calibrate_flight(const CalibrateFlightOptions& options,
                                  const Progress& progress = {});

}  // namespace risley::jobs
