// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/inspect_recording.hpp"

#include <utility>

#include "risley/jobs/recording_input.hpp"

#include "jobs/packet_recording.hpp"

namespace risley::jobs {

InspectedRecording inspect_recording(const InspectRecordingOptions& options,
                                     const Progress& progress) {
  InspectedRecording result;
  PlacedInput input = place_input(options.recording, options.reading, UntoldShots::guessed,
                                  progress.stage("placing"));
  if (!options.excerpt.empty()) {  // first, because it may have to be refused
    result.excerpt =
        recordings::write_excerpt(options.recording, options.excerpt, options.excerpt_options,
                                  input.reading, progress.stage("sharing"));
  }
  const Progress reading = progress.stage("reading");
  const std::unique_ptr<recordings::Reader>& reader = input.reader;
  recordings::TimeAudit audit;
  recordings::Chunk chunk;
  UntimedShots untimed;
  try {
    while (reader->read(chunk)) {
      audit.add(chunk);
      if (!reader->header().has_times && !untimed.enough()) untimed.add(chunk.observations);
      reading.report(reader->fraction_read());
    }
  } catch (const FileError& error) {
    result.damage = error;  // what was sound before is still told
  }
  result.header = reader->header();
  result.audit = audit.result();
  result.audit.pps_wraps = reader->clock_wraps();
  result.warnings = reader->warnings();
  for (const std::string& words : input.words) result.warnings.push_back({{}, words});
  result.time_uncertainty = input.time_uncertainty;
  if (!result.header.has_times) {
    const std::string words = untimed.removed_words();
    if (!words.empty()) result.warnings.push_back({{}, words});
  }
  if (input.choice) result.choice = std::move(input.choice);
  if (!result.choice && result.header.devices.size() == 1 && result.audit.shots > 0) {
    try {
      result.choice = choose_sensor(options.recording, options.reading, result.header, {},
                                    progress.stage("recognising"));
    } catch (const InvalidArgument&) {  // no preset of that type: the header names it all the same
    }
  }
  if (!result.choice) return result;
  for (const std::string& words : result.choice->warnings) result.warnings.push_back({{}, words});
  return result;
}

}  // namespace risley::jobs
