// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/cloud/make_cloud.hpp"
#include "risley/core/progress.hpp"
#include "risley/jobs/moving_platform.hpp"
#include "risley/jobs/provenance.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// Which points to make.
struct CloudOfRecordingOptions {
  recordings::Source recording;     ///< of one sensor, with ranges
  recordings::ReadOptions reading;  ///< see open_in_sensor_frame() where it holds no extrinsics
  std::string calibration;          ///< preset by name, or a preset or calibration file
  std::string output;               ///< path; its ending chooses the format unless one is named
  PlatformFiles platform;           ///< of a sensor that moved
  cloud::CloudOptions cloud;        ///< without a platform and provenance
  Provenance provenance;            ///< goes into it, with input's and calibration's SHA-256
};

/// The points of a recording.
struct RecordingCloud {
  std::string recording, output, calibration;  ///< as the options have them
  sensors::CalibrationReference calibrated_against = sensors::CalibrationReference::none;
  cloud::CloudSummary summary;
};

/// Turns a recording into points with covariance; the output appears when it is whole.
/// @throws EstimationError, InvalidArgument, FileError, Cancelled
RecordingCloud cloud_of_recording(const CloudOfRecordingOptions& options,
                                  const Progress& progress = {});

}  // namespace risley::jobs
