// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/identify_recording.hpp"

#include <filesystem>
#include <limits>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/setting.hpp"
#include "risley/identification/soundness.hpp"
#include "risley/io/text_file.hpp"
#include "risley/jobs/prepared_recording.hpp"
#include "risley/jobs/recording_input.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/recordings/plausibility.hpp"
#include "risley/sensors/preset.hpp"

#include "jobs/stopwatch.hpp"

namespace risley::jobs {
namespace {

using identification::EmitterTiming;
using identification::Identification;

estimation::AngleSeries read(const recordings::Source& recording,
                             const IdentifyRecordingOptions& options, IdentifiedRecording& result,
                             const Progress& progress) {
  PreparedRecording input = prepare_recording(recording, options.reading, {}, progress);
  const std::unique_ptr<recordings::Reader>& reader = input.reader;
  const recordings::RecordingHeader& header = reader->header();
  recordings::require_one_device(header, options.recording.name());
  recordings::require_times(header);
  input.require_whole();
  input.close_questions();
  estimation::ShotSelector selector({});
  recordings::Chunk chunk;
  while (reader->read(chunk)) {
    selector.add(chunk.observations);
    progress.report(reader->fraction_read());
  }
  result.warnings = input.all_warnings();
  warn_of_left_out(selector.counts(), result.warnings);
  result.cropped = input.choice.has_value();
  if (result.cropped) {
    warn(result.warnings, kWarning.packets_incomplete,
         "the optics of {} were used to find when the shots in packets with missing points were "
         "fired: the result here is not independent of them",
         input.choice->sensor.name);
  }
  return selector.take_series();
}

/// The built-in preset with the identified train.
void find_like(IdentifiedRecording& result) {
  const bool together = result.identification.timing == EmitterTiming::together;
  double least = std::numeric_limits<double>::infinity();
  for (const std::string& name : sensors::builtin_preset_names()) {
    const sensors::Sensor type = sensors::load_sensor(name);
    for (const sensors::Sensor& sensor : sensors::in_all_combinations(type)) {
      const auto like = identification::likeness(result.identification, sensor);
      if (!like) continue;
      // Presets that share a train: first those that are not mirror images, then those with the
      // same firing scheme.
      const bool fires_together =
          sensor.sequence && sensor.sequence->firing == sensors::Firing::together;
      const double distance =
          like->worst + (like->mirrored ? 4 : 0) + (fires_together != together ? 2 : 0);
      if (distance >= least) continue;
      least = distance;
      result.like = name;
      result.like_mirrored = like->mirrored;
    }
  }
}

void judge(IdentifiedRecording& result) {
  const Identification& found = result.identification;
  const double left = found.best().fit.rms;
  const std::string rms =
      fmt::format("{:.2g} degree ({})", degrees_from_radians(left), offset_text(left));
  if (!found.fits) {
    result.verdict = IdentificationVerdict::inconsistent;
    result.words = fmt::format(
        "none of the trains of up to three prisms that were tried describes this scan: the best "
        "one leaves {}",
        rms);
    result.to_do = result.cropped
                       ? "export the recording again without cropping or filtering it: a small "
                         "part of the field of view shows no lines; for a known sensor, an "
                         "estimate works there, too, because it starts from known values"
                       : fmt::format(
                             "check the times ({} gives the rate of counted shots) and that the "
                             "recording is of one sensor at rest",
                             name_of(kSetting.shot_rate));
    return;
  }
  if (!found.decided) {
    result.verdict = IdentificationVerdict::undecided;
    result.words = fmt::format(
        "several trains describe this scan: the best one leaves {}, and the chi squared of another "
        "is larger by only {:.3g}, where {:.0f} would be needed to decide between them",
        rms, found.hypotheses.size() > 1 ? found.hypotheses[1].excess : 0.0,
        identification::kFairLead);
    result.to_do = "record for longer, or with less of the field of view without returns";
    return;
  }
  const identification::Doubt doubt = identification::doubt_of(found, result.sensor.sensor);
  if (!doubt.words.empty()) {
    result.verdict =
        doubt.refuted ? IdentificationVerdict::inconsistent : IdentificationVerdict::undecided;
    result.words = fmt::format("{}; it leaves {}", doubt.words, rms);
    result.to_do =
        "check that the recording is of one sensor at rest, with all prisms turning, and record "
        "for longer";
    return;
  }
  result.verdict = IdentificationVerdict::identified;
  result.words =
      fmt::format("one train{} describes this scan and leaves {}",
                  found.best().equivalent_to.empty() ? "" : ", or its equivalents,", rms);
}

void say_what_is_never_told(IdentifiedRecording& result) {
  const Identification& found = result.identification;
  std::vector<std::string>& words = result.unobservable;
  if (found.emitters == 1) {
    words.emplace_back(
        "a single emitter on the axis shows only how far the first prism deflects its beam: the "
        "prism's face order, wedge angle and refractive index cannot be separated, and its glass "
        "is assumed to be that of the others");
  } else if (found.freedom.one_glass) {
    words.emplace_back(
        "the prisms are assumed to be of the same glass, which fits the data; the sigmas do not "
        "rely on that");
  }
  words.emplace_back(
      "a wedge of the opposite sign is the same wedge rotated by half a turn, and the mirror image "
      "of a scan is the scan of the same prisms turning the other way");
  words.emplace_back(
      "refractive indices are relative to air; windows, and fixed wedges in front of the first "
      "prism, cannot be detected");
}

void write(const recordings::Source& recording, const IdentifyRecordingOptions& options,
           IdentifiedRecording& result, const Progress& progress) {
  if (options.output.empty()) return;
  if (result.verdict != IdentificationVerdict::identified && !options.undecided) return;
  sensors::Sensor sensor = result.sensor.sensor;
  sensor.provenance = with_inputs(options.provenance, {recording}, progress);
  io::write_text_file(options.output, sensors::preset_text(sensor));
  result.written = true;
}

}  // namespace

std::string to_string(IdentificationVerdict verdict) {
  switch (verdict) {
    case IdentificationVerdict::identified:
      return "identified";
    case IdentificationVerdict::undecided:
      return "undecided";
    case IdentificationVerdict::inconsistent:
      return "inconsistent";
  }
  return {};
}

IdentifiedRecording identify_recording(const IdentifyRecordingOptions& options,
                                       const Progress& progress) {
  progress.check();
  IdentifiedRecording result;
  const Stopwatch reading;
  const recordings::Source recording = options.recording.held_open();
  const estimation::AngleSeries series =
      read(recording, options, result, progress.stage("reading"));
  result.reading_time = reading.seconds();
  const Stopwatch solving;
  try {
    result.identification =
        identification::identify(series, options.identify, progress.stage("identifying"));
  } catch (const EstimationError& error) {
    const bool is_scan = !recordings::not_a_scan(series.azimuth, series.zenith, {});
    if (is_scan || result.warnings.empty()) throw;
    throw EstimationError(
        fmt::format("{}: {}", warning_text(result.warnings.front()), error.what()));
  }
  result.solving_time = solving.seconds();
  find_like(result);
  const std::string name =
      options.output.empty() ? "identified" : std::filesystem::path(options.output).stem().string();
  result.sensor = identification::identified_sensor(
      result.identification, name,
      sensors::load_sensor(result.like.empty() ? kUsualSensor : result.like));
  judge(result);
  say_what_is_never_told(result);
  write(recording, options, result, progress.silent());
  return result;
}

}  // namespace risley::jobs
