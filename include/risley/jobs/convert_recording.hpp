// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/writer.hpp"

namespace risley::jobs {

/// Input, output and format of a conversion.
struct ConvertRecordingOptions {
  std::string recording;  ///< path
  recordings::ReadOptions reading;
  std::string output;  ///< path
  std::string format;  ///< as recordings::create_recording(); empty: by the output's ending
  /// Livox device type of the sensor if the recording does not state it; empty: recognised from
  /// its scan.
  std::optional<std::uint8_t> sensor_type;
  recordings::WriteOptions writing = {};  ///< options of the format
};

/// What came of it.
struct ConvertedRecording {
  std::uint64_t observations = 0;  ///< read
  std::uint64_t left_out = 0;      ///< of them, because the format cannot hold them
  std::string input_format;
  std::optional<SensorChoice> choice;  ///< if the file does not name the sensor
  std::vector<Warning> warnings;
  /// Possible error of guessed times, s; 0: there are none.
  double time_uncertainty = 0;
  std::optional<FileError> damage;  ///< of the recording's body; the part before it was written
};

/// Writes a recording in another format; the output appears when it is complete.
/// @throws InvalidArgument, also when the recording names another type of sensor; FileError;
///         Cancelled
ConvertedRecording convert_recording(const ConvertRecordingOptions& options,
                                     const Progress& progress = {});

}  // namespace risley::jobs
