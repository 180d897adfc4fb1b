// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/calibration/calibrate.hpp"
#include "risley/calibration/datum.hpp"
#include "risley/calibration/flight_calibration.hpp"
#include "risley/calibration/flight_recordings.hpp"
#include "risley/calibration/plane_points.hpp"
#include "risley/core/progress.hpp"
#include "risley/sensors/sensor.hpp"
#include "risley/trajectories/mount.hpp"

namespace risley::jobs {

/// Assumed beam directions before and after a calibration, compared with the true ones.
struct BeamComparison {
  calibration::DirectionErrors before, after;
  sensors::Sensor truth;  ///< of the first recording
  /// Computed minus true angles of some beams, rad.
  std::vector<double> azimuth_before, zenith_before, azimuth_after, zenith_after;
};

/// Compares an evenly spread sample of the beams of all recordings.
/// @param truths  OUT.truth.yaml of each recording's simulation, with OUT.truth.nc beside it
/// @throws InvalidArgument unless there is one for each recording; FileError; Cancelled
BeamComparison compare_beams(const std::vector<calibration::RangedRecording>& recordings,
                             const calibration::Calibration& calibration,
                             const std::vector<std::string>& truths, const Progress& progress = {});

/// Assumed beam directions of a moving sensor before and after a calibration, boresight and prisms
/// together, compared with the true ones, sensor axes as the mount was designed.
struct FlightTruth {
  calibration::DirectionErrors before, after;
  sensors::Sensor sensor;     ///< true, of the first recording
  trajectories::Mount mount;  ///< true
};

/// Compares an evenly spread sample of the beams of all recordings.
/// @param flight  made of the recordings
/// @param given   the mount before the calibration
/// @param truths  as for compare_beams(); OUT.mount.truth.yaml is beside each, too
/// @throws as compare_beams()
FlightTruth compare_flight_beams(const std::vector<calibration::RangedRecording>& recordings,
                                 const calibration::FlightRecordings& flight,
                                 const trajectories::Mount& given,
                                 const calibration::FlightCalibration& found,
                                 const std::vector<std::string>& truths,
                                 const Progress& progress = {});

}  // namespace risley::jobs
