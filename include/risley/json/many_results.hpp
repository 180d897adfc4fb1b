// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "risley/core/error.hpp"
#include "risley/jobs/calibrate_recordings.hpp"
#include "risley/jobs/cloud_of_recording.hpp"
#include "risley/jobs/estimate_recording.hpp"
#include "risley/jobs/many_inputs.hpp"
#include "risley/json/results.hpp"
#include "risley/recordings/writer.hpp"

namespace risley::json {

/// How an exception ends a job.
struct Failure {
  jobs::ExitStatus status = jobs::kNumbersFailed;
  std::string message;
  Json details;  ///< may be null
};

/// Of the exception that is being handled.
Failure current_failure();

/// Members of verbs with a verdict if nothing could be estimated.
Json undecided(const std::string& message);

/// The result of a job that processed a file up to its damage, with the exit status.
Json with_status(Json result, const std::optional<FileError>& damage);

/// Receives messages for people while inputs are processed, from several threads.
using Note = std::function<void(const std::string& words, bool is_wrong)>;

// A job for each of many inputs: the options are those of one, without its recording and output.
// They are checked before anything is read: InvalidArgument.

/// As jobs::estimate_recording().
jobs::InputWork estimate_each(jobs::EstimateRecordingOptions options, const Note& note);
/// Each recording calibrated separately.
jobs::InputWork calibrate_each(jobs::CalibrateRecordingsOptions options, const Note& note);

/// Writes pages about a cloud and notes them in its result.
using CloudPages = std::function<void(const jobs::RecordingCloud&, Json&)>;
/// @param pages  their files are to be added to those of the work; may be empty
jobs::InputWork cloud_each(jobs::CloudOfRecordingOptions options, const CloudPages& pages,
                           const Note& note);

/// Of recordings and trajectories.
struct InspectEachOptions {
  recordings::ReadOptions reading;
  std::string accuracy, topic;  ///< as jobs::InspectTrajectoryOptions
};
/// As jobs::inspect_recording() and jobs::inspect_trajectory().
jobs::InputWork inspect_each(InspectEachOptions options, const Note& note);

/// Of recordings and trajectories.
struct ConvertEachOptions : InspectEachOptions {
  std::string format;                       ///< empty: as the outputs' names end
  std::optional<std::uint8_t> sensor_type;  ///< as jobs::ConvertRecordingOptions
  recordings::WriteOptions writing = {};
};
/// As jobs::convert_recording() and jobs::convert_trajectory().
jobs::InputWork convert_each(ConvertEachOptions options, const Note& note);

/// One of "results": "status" and "message" replace the "error" of a single object.
Json one_of_several(const jobs::InputJob& job, const jobs::InputResult& result);
/// done, failed, skipped and the count.
Json counts_of(const jobs::InputRun& run, const jobs::InputWork& work);

/// Writes a table with a row per input. @param about  its title, with the version of the program
void write_table(const std::string& path, const jobs::InputRun& run, const jobs::Provenance& about);
/// The same rows as objects, with the keys of the columns.
Json rows_of(const jobs::InputRun& run, const std::string& version);

}  // namespace risley::json
