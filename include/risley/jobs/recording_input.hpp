// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/packed_series.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/time_audit.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// One recording, read to its end.
struct ReadRecording {
  std::string path;  ///< as recordings::Source::name()
  recordings::RecordingHeader header;
  recordings::TimeAuditResult audit;

  /// Of the sensor; empty when unknown.
  const std::string& serial() const { return header.devices.front().serial; }
};

/// Settings for reading a recording for an estimation.
struct EstimationInputOptions {
  recordings::Source recording;            ///< of one sensor, with times
  recordings::ReadOptions reading;         ///< see prepare_recording() where it holds no extrinsics
  GivenSensor sensor;                      ///< as given_sensor()
  estimation::SelectionOptions selection;  ///< ranges of whole steps are kept anyway
};

/// Result of reading a recording for an estimation.
struct EstimationInput {
  ReadRecording recording;
  SensorChoice choice;
  estimation::PackedSeries series;  ///< the chosen shots, in the sensor's frame
  estimation::AngleSeries head;     ///< every shot of the first second
  estimation::StartFindings found;  ///< about the head
  estimation::SelectionCounts counts;
  std::vector<Warning> warnings;  ///< of the reader, about frame, sensor and clock
  bool whole_steps = false;       ///< directions come from coordinates in whole steps
  double reading_time = 0;        ///< s
};

/// Reads all of a recording of one sensor in the sensor's frame.
/// @throws InvalidArgument for a recording of several sensors; as prepare_recording(); FileError
///         at damage
EstimationInput read_for_estimation(const EstimationInputOptions& options,
                                    const Progress& progress = {});

/// Reports which shots were skipped because their times do not show when they were fired.
void warn_of_left_out(const estimation::SelectionCounts& counts, std::vector<Warning>& warnings);

}  // namespace risley::jobs
