// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/identification/identified_sensor.hpp"
#include "risley/identification/identify.hpp"
#include "risley/jobs/provenance.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::jobs {

/// Input and output of an identification.
struct IdentifyRecordingOptions {
  recordings::Source recording;     ///< of one sensor
  recordings::ReadOptions reading;  ///< no pose of the header is used: the frame is found
  identification::IdentifyOptions identify;
  std::string output;      ///< preset to write; empty: none
  bool undecided = false;  ///< it is written even if the result is uncertain
  Provenance provenance;   ///< goes into it, together with the recording's SHA-256
};

/// How sure the answer is.
enum class IdentificationVerdict {
  identified,    ///< one train, or one class of equivalent trains, describes the scan
  undecided,     ///< several trains that are not equivalent describe it as well
  inconsistent,  ///< no tried train describes it
};

/// The name of the enumerator: "identified", "undecided" or "inconsistent".
std::string to_string(IdentificationVerdict verdict);

/// What came of it.
struct IdentifiedRecording {
  identification::Identification identification;
  identification::IdentifiedSensor sensor;
  IdentificationVerdict verdict = IdentificationVerdict::undecided;
  std::string words, to_do;
  std::string like;                       ///< the built-in preset with this train; empty: none
  bool like_mirrored = false;             ///< it is the preset's mirror image
  std::vector<std::string> unobservable;  ///< what such recordings cannot determine
  std::vector<Warning> warnings;
  bool cropped = false;  ///< packets lack points; times follow from a preset's optics
  bool written = false;
  double reading_time = 0, solving_time = 0;  ///< s
};

/// Identifies the train of prisms behind a recording from its times and directions alone. Stages:
/// reading, identifying.
/// @throws EstimationError when the data give no result; InvalidArgument; FileError; Cancelled
IdentifiedRecording identify_recording(const IdentifyRecordingOptions& options,
                                       const Progress& progress = {});

}  // namespace risley::jobs
