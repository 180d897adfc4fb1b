// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/setting.hpp"
#include "risley/core/text.hpp"
#include "risley/identification/fitted_values.hpp"
#include "risley/jobs/identify_recording.hpp"

#include "command.hpp"
#include "reading_options.hpp"
#include "result_folder.hpp"
#include "table.hpp"
#include "warning_log.hpp"

namespace risley::app {
namespace {

using identification::Hypothesis;
using jobs::IdentifiedRecording;

struct IdentifyCommandOptions {
  std::string input, output;
  int most_prisms = 3;
  double fastest_hz = 400;
  bool force = false;
  ReadingWishes reading;
};

void print_outcome(const IdentifiedRecording& outcome) {
  const identification::Identification& found = outcome.identification;
  say("{}: {}\n", to_string(outcome.verdict), outcome.words);
  if (!outcome.like.empty()) {
    say("this is the train of {}{}\n", outcome.like,
        outcome.like_mirrored ? ", as its mirror image" : "");
  }
  say("{} shots at {:.6g} Hz, {} emitter{}{}\n\n", grouped(found.rows), 1 / found.step,
      found.emitters, found.emitters == 1 ? "" : "s",
      found.emitters == 1                                      ? ""
      : found.timing == identification::EmitterTiming::in_turn ? ", one after another"
      : found.timing == identification::EmitterTiming::together
          ? ", the shots of a round share the rotors' position"
          : ", at uneven times");
  Table parameters({"parameter", "value", "+- sigma", "unit"});
  for (const identification::FittedValue& one : identification::fitted_values(found.best())) {
    if (std::isfinite(one.sigma) && one.sigma > 0) {
      const NumberText text = number_text(one.value, one.sigma);
      parameters.add({one.name, text.value, text.sigma, one.unit});
    } else {
      parameters.add({one.name, fmt::format("{:.8g}", one.value), "held", one.unit});
    }
  }
  parameters.print();
  say("\n");
  Table ranking({"faces", "speeds Hz", "rms deg", "chi2 more than the best", "equivalent to"});
  std::size_t rows = 0;
  for (const Hypothesis& one : found.hypotheses) {
    if (++rows > 8) break;
    std::string speeds, same;
    for (int k = 0; k < one.train().prisms(); ++k) {
      speeds += fmt::format("{}{:.3f}", k == 0 ? "" : " ",
                            one.fit.model.rotors.mean_angular_velocity(k) / kTwoPi);
    }
    for (const std::size_t other : one.equivalent_to) {
      same += (same.empty() ? "" : " ") + to_string(found.hypotheses[other].train().face_order());
    }
    ranking.add({to_string(one.train().face_order()), speeds,
                 fmt::format("{:.3g}", degrees_from_radians(one.fit.rms)),
                 fmt::format("{:.3g}", one.excess), same});
  }
  ranking.print();
  say("\n");
  for (const std::string& words : outcome.unobservable) say("cannot be determined: {}.\n", words);
  if (!outcome.to_do.empty()) say("what to do: {}.\n", outcome.to_do);
}

ExitStatus run_identify(const IdentifyCommandOptions& options, const CommonOptions& common) {
  require_positive(kSetting.fastest, options.fastest_hz);
  require_apart(common, {options.output});
  jobs::IdentifyRecordingOptions job;
  job.recording = options.input;
  job.reading = read_options(options.reading);
  job.identify.most_prisms = options.most_prisms;
  job.identify.fastest = kTwoPi * options.fastest_hz;
  job.output = options.output;
  job.undecided = options.force;
  job.provenance = provenance_of(common);
  IdentifiedRecording outcome;
  {
    ProgressBar bar("identifying", common);
    outcome = jobs::identify_recording(job, bar.progress());
  }
  log_warnings(outcome.warnings);
  if (!options.output.empty() && !outcome.written) {
    spdlog::warn("{} was not written: {}; --force writes it anyway", options.output, outcome.words);
  }
  if (common.json) {
    print_json(common, json::of(outcome), outcome.sensor.sensor.provenance);
  } else {
    print_outcome(outcome);
  }
  return outcome.verdict == jobs::IdentificationVerdict::identified ? kDone : kNumbersFailed;
}

}  // namespace

Run declare_identify(CLI::App& verb) {
  const auto options = std::make_shared<IdentifyCommandOptions>();
  IdentifyCommandOptions& o = *options;
  verb.add_option("INPUT", o.input, "Recording of one sensor, of any known format")->required();
  verb.add_option("-o,--output", o.output,
                  "Preset to write (.yaml), which other verbs take as --sensor (default: none)");
  verb.add_flag("--force", o.force, "Write the preset even if the result is uncertain");
  verb.add_option("--most-prisms", o.most_prisms, "Largest number of prisms to try")
      ->check(CLI::Range(1, 3))
      ->capture_default_str();
  verb.add_option("--fastest-hz", o.fastest_hz,
                  "Highest speed of a rotor to look for, revolutions per second")
      ->capture_default_str();
  add_reading_options(verb, o.reading);
  return [options](const CommonOptions& common) { return run_identify(*options, common); };
}

}  // namespace risley::app
