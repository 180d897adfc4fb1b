// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/inspect_recording.hpp"

#include <utility>

#include "risley/jobs/prepared_recording.hpp"

namespace risley::jobs {

InspectedRecording inspect_recording(const InspectRecordingOptions& options,
                                     const Progress& progress) {
  InspectedRecording result;
  PreparedRecording input =
      prepare_recording(options.recording, options.reading, {.untold = UntoldShots::guessed},
                        progress.stage("placing"));
  if (!options.excerpt.empty()) {  // first, because it may have to be rejected
    result.excerpt =
        recordings::write_excerpt(input.source, options.excerpt, options.excerpt_options,
                                  input.reading, progress.stage("sharing"));
  }
  if (input.reader->header().devices.size() == 1) {
    try {
      input.choose({}, progress.stage("recognising"));
    } catch (const InvalidArgument&) {  // no preset of that type: the header names it anyway
    }
  }
  std::string removed;
  if (!input.reader->header().has_times) removed = input.removed_shots_words(progress.silent());
  input.close_questions();
  const Progress reading = progress.stage("reading");
  const std::unique_ptr<recordings::Reader>& reader = input.reader;
  recordings::TimeAudit audit(reader->header());
  recordings::Chunk chunk;
  try {
    while (reader->read(chunk)) {
      audit.add(chunk);
      reading.report(reader->fraction_read());
    }
  } catch (const FileError& error) {
    result.damage = error;  // the undamaged part is still reported
  }
  result.header = reader->header();
  result.audit = audit.result();
  result.audit.pps_wraps = reader->clock_wraps();
  result.warnings = input.all_warnings();
  if (!removed.empty()) result.warnings.push_back({kWarning.shots_lost, removed});
  result.time_uncertainty = input.time_uncertainty;
  result.choice = std::move(input.choice);
  if (result.audit.shots == 0) result.choice.reset();
  if (result.choice) append(result.warnings, result.choice->warnings);
  return result;
}

}  // namespace risley::jobs
