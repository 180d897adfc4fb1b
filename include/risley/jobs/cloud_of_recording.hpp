// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
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
  recordings::ReadOptions reading;  ///< see open_in_sensor_frame() if it holds no extrinsics
  /// As load_result(); for a calibration in flight its folder, whose mount and trajectory are used
  /// if the platform names none. Empty: the preset of the recording's sensor, with directions as
  /// reported.
  GivenSensor calibration;
  std::string output;         ///< path; its ending chooses the format unless one is named
  bool replace = false;       ///< rewrite the recording's bag with rectified points
  PlatformFiles platform;     ///< of a sensor that moved
  cloud::CloudOptions cloud;  ///< without a platform and provenance
  Provenance provenance;      ///< goes into it, with input's and calibration's SHA-256
};

/// The points of a recording.
struct RecordingCloud {
  std::string recording, output, calibration;  ///< as the options have them
  sensors::CalibrationReference calibrated_against = sensors::CalibrationReference::none;
  cloud::CloudSummary summary;
};

/// Points of a recording, piece by piece, for the caller's sink.
class PointsOfRecording {
 public:
  /// @param options  output, provenance and the format of a file are ignored
  /// @param progress  its flag must outlive this
  /// @throws EstimationError, InvalidArgument, FileError, Cancelled
  PointsOfRecording(const CloudOfRecordingOptions& options, cloud::CloudSink sink,
                    const Progress& progress);
  ~PointsOfRecording();
  PointsOfRecording(const PointsOfRecording&) = delete;
  PointsOfRecording& operator=(const PointsOfRecording&) = delete;

  /// As cloud::CloudMaker::next().
  bool next();
  /// The result; complete once next() has returned false.
  RecordingCloud result() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Turns a recording into points with covariance, or, to replace those of its bag, rewrites it with
/// calibrated directions and everything else unchanged; the output appears when it is complete.
/// @throws EstimationError, InvalidArgument, FileError, Cancelled
RecordingCloud cloud_of_recording(const CloudOfRecordingOptions& options,
                                  const Progress& progress = {});

}  // namespace risley::jobs
