// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "risley/calibration/calibrate.hpp"
#include "risley/core/progress.hpp"
#include "risley/jobs/beam_comparison.hpp"
#include "risley/jobs/calibration_details.hpp"
#include "risley/jobs/ranged_input.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/scenes/scene.hpp"

namespace risley::jobs {

struct CalibratedRecordings;

/// Input and settings of a calibration. SI units.
struct CalibrateRecordingsOptions : RangedInputOptions {  ///< recordings of plane walls
  HeldParameters fixed;
  std::vector<std::string> additional;  ///< further parameters to free
  /// As calibration::CalibrationOptions has them.
  calibration::CalibrationMethod method = calibration::CalibrationMethod::adjustment;
  std::optional<double> range_noise, prior_sigma;
  double range_offset_sigma = calibration::CalibrationOptions{}.range_offset_sigma;
  std::optional<double> tolerance;  ///< of directions, rad
  bool flat_walls = false;          ///< exact planes, and no range errors except a constant one
  double patch_thickness = calibration::CalibrationOptions{}.patch_thickness;
  calibration::SameWalls same_walls = calibration::SameWalls::if_found;
  bool beam_origin = true;
  std::optional<scenes::Scene> planes;
  std::vector<scenes::Station> stations;  ///< one per recording, or none
  std::uint64_t seed = 0;
  std::vector<std::string> truths;  ///< OUT.truth.yaml of each recording to compare with, or none
  bool details = false;             ///< wanted in the result
  bool force = false;  ///< also write a calibration that does not improve on the sensor's own
                       ///< parameters
  /// Names the outputs; without them nothing is written. States of several recordings are
  /// states_1.nc, states_2.nc, ...
  ResultFiles files;
  /// Further files of the folder, such as a page, made from the result.
  std::function<std::vector<NamedText>(const CalibratedRecordings&)> texts;
};

/// Checks the options before reading anything. @throws InvalidArgument
void check(const CalibrateRecordingsOptions& options);

/// The stations of recordings, in their order.
/// @param path   of a scene with stations; empty: none
/// @param names  the stations to use, one per recording; empty: all, one per recording
/// @throws InvalidArgument with both numbers if they differ; FileError
std::vector<scenes::Station> stations_of(const std::string& path,
                                         const std::vector<std::string>& names,
                                         std::size_t recordings);

/// What came of it.
struct CalibratedRecordings : RangedInput {
  calibration::Calibration calibration;
  std::optional<BeamComparison> truth;        ///< where it is known
  std::optional<CalibrationDetails> details;  ///< where they were asked for
  bool calibration_written = false;           ///< calibration.yaml
  Provenance provenance;    ///< of the options, with the inputs; empty if nothing was written
  double solving_time = 0;  ///< s
  double total_time = 0;    ///< of the job, s
};

/// Finds the rotation angles of every recording and calibrates the sensor on the walls in them.
/// Stages, for each recording: reading, rotation angles; then calibrating.
/// @throws EstimationError when there is no basis for a calibration; InvalidArgument, also for a
/// recording given twice; FileError; Cancelled
CalibratedRecordings calibrate_recordings(const CalibrateRecordingsOptions& options,
                                          const Progress& progress = {});

}  // namespace risley::jobs
