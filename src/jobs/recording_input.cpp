// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/recording_input.hpp"

#include <array>
#include <utility>

#include "risley/core/setting.hpp"
#include "risley/jobs/prepared_recording.hpp"
#include "risley/parallel/parallel.hpp"

#include "jobs/stopwatch.hpp"

namespace risley::jobs {
namespace {

/// Whether a start of one is a start of the other.
bool are_same_shots(const estimation::AngleSeries& a, const estimation::AngleSeries& b) {
  return a.time_ns == b.time_ns && a.azimuth == b.azimuth && a.zenith == b.zenith &&
         a.beam == b.beam && a.azimuth_rounding_variance == b.azimuth_rounding_variance &&
         a.zenith_rounding_variance == b.zenith_rounding_variance;
}

}  // namespace

EstimationInput read_for_estimation(const EstimationInputOptions& options,
                                    const Progress& progress) {
  const Stopwatch watch;
  PreparedRecording input =
      prepare_recording(options.recording, options.reading,
                        {.sensor_frame = true, .sensor = given_sensor(options.sensor)}, progress);
  recordings::Reader& reader = *input.reader;
  const std::string name = input.source.name();
  recordings::require_one_device(reader.header(), name);
  input.require_whole();
  input.source = {};  // the last pass over the rows
  EstimationInput result;
  result.whole_steps = reader.header().cartesian && !input.turned_back && !input.cut_mended;
  estimation::SelectionOptions selection = options.selection;
  selection.ranges = options.selection.ranges || result.whole_steps;
  estimation::ShotSelector selector(selection);
  recordings::TimeAudit audit(reader.header());
  // While some chunks are processed, the next are read.
  std::array<recordings::Chunk, 4> chunks;
  const auto read_next = [&](std::size_t slot) {
    if (!reader.read(chunks[slot])) return false;
    progress.report(reader.fraction_read());
    return true;
  };
  using Order = parallel::Stage::Order;
  parallel::run_pipeline(chunks.size(), read_next,
                         {{Order::in_turn, [&](std::size_t slot) { audit.add(chunks[slot]); }},
                          {Order::in_turn, [&](std::size_t slot) {
                             selector.add(chunks[slot].observations);
                             result.series.append(selector.take_series());
                           }}});
  result.recording = {name, reader.header(), audit.result()};
  result.warnings = input.all_warnings();
  result.choice = *std::move(input.choice);
  result.counts = selector.counts();
  warn_of_left_out(result.counts, result.warnings);
  if (result.counts.clock_resets > 0) {
    warn(result.warnings, kWarning.clock_reset,
         "the clock of the recording jumps back {} times: the pieces share their parameters, and "
         "the rotors are found anew in each",
         result.counts.clock_resets);
  }
  result.head = selector.head();
  if (are_same_shots(result.head, input.first.head)) result.found = std::move(input.first.found);
  result.reading_time = watch.seconds();
  return result;
}

void warn_of_left_out(const estimation::SelectionCounts& counts, std::vector<Warning>& warnings) {
  if (counts.out_of_order > 0) {
    warn(warnings, kWarning.shots_unused,
         "{} of {} shots are a little earlier than the shot before and were dropped: packets came "
         "late",
         counts.out_of_order, counts.rows);
  }
  if (counts.equal_times > 0) {
    warn(warnings, kWarning.shots_unused,
         "{} of {} shots have the time of the shot before, so their firing times are unknown and "
         "they were dropped: {} counts shots, where none is missing",
         counts.equal_times, counts.rows, name_of(kSetting.shot_rate));
  }
}

}  // namespace risley::jobs
