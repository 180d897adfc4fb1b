// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/time_audit.hpp"

#include "command.hpp"
#include "recording_input.hpp"

namespace risley::app {

/// What reading a recording leaves for an estimation.
struct RecordingInput {
  std::unique_ptr<recordings::Reader> reader;
  recordings::TimeAuditResult audit;
  estimation::ShotSelector selector;
  std::vector<std::string> warnings;  ///< of the reader, about frame, sensor and clock
  /// Rows come from coordinates in whole steps along the axes of their frame.
  bool whole_steps = false;
  double seconds = 0;
};

/// Reads all of a recording of one sensor, which must have times, in the sensor's frame.
/// @param sensor  as EstimationWishes::sensor
RecordingInput read_recording(const std::string& path, const ReadingWishes& reading,
                              const std::string& sensor,
                              const estimation::SelectionOptions& selection,
                              const CommonOptions& common);

/// What the user says about sensor and parameters, as typed.
struct EstimationWishes {
  std::string sensor;  ///< empty: from the recording
  std::optional<double> noise_angle_deg;
  std::vector<std::string> fixed, freed;
};

/// @param header  of the recording; without one the wishes must name a sensor
estimation::EstimateOptions estimate_options(
    const EstimationWishes& wishes, const std::optional<recordings::RecordingHeader>& header);

/// Declares --fix and --free.
void add_parameter_choice(CLI::App& verb, std::vector<std::string>& fixed,
                          std::vector<std::string>& freed);

}  // namespace risley::app
