// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/recordings/excerpt.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/time_audit.hpp"

namespace risley::jobs {

/// What to look at.
struct InspectRecordingOptions {
  recordings::Source recording;
  recordings::ReadOptions reading;
  std::string excerpt;                         ///< file to write one to (.nc); empty: none
  recordings::ExcerptOptions excerpt_options;  ///< what it may hold
};

/// What a recording holds.
struct InspectedRecording {
  recordings::RecordingHeader header;
  /// The sensor; empty for a recording of several, or of a type without a built-in preset.
  std::optional<SensorChoice> choice;
  recordings::TimeAuditResult audit;
  std::vector<Warning> warnings;
  /// Possible error of guessed times, s; 0: there are none.
  double time_uncertainty = 0;
  std::optional<FileError> damage;  ///< of its body; the audit covers the part before it
  std::optional<recordings::Excerpt> excerpt;
};

/// Reads a recording to its end, audits its times and recognises its sensor. Stages: placing,
/// sharing, reading, recognising.
/// @throws FileError when it cannot be opened; InvalidArgument; Cancelled
InspectedRecording inspect_recording(const InspectRecordingOptions& options,
                                     const Progress& progress = {});

}  // namespace risley::jobs
