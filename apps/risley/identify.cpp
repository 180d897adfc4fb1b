// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/jobs/identify_recording.hpp"

#include "command.hpp"
#include "option_names.hpp"
#include "reading_options.hpp"
#include "recording_text.hpp"
#include "result_folder.hpp"
#include "table.hpp"

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

/// What a hypothesis says of a parameter, in the unit of files; sigmas NaN where it has none.
struct FittedValue {
  std::string name, unit;
  double value = 0, sigma = 0, sigma_given_held = 0;
};

std::vector<FittedValue> values_of(const Hypothesis& hypothesis) {
  const identification::TrainFit& fit = hypothesis.fit;
  const TrainShape shape = hypothesis.train().shape();
  std::vector<FittedValue> values;
  for (const ParameterInfo& info : parameter_list(shape)) {
    if (info.kind == ParameterKind::train && info.places.size() > 1) continue;
    double value = 0;
    const int place = info.places.front();
    const identification::RotorCurves& rotors = fit.model.rotors;
    if (info.kind == ParameterKind::train) {
      value = hypothesis.train()[place];
    } else if (info.kind == ParameterKind::angular_velocity) {
      value = rotors.mean_angular_velocity(place);
    } else {
      value = wrap_to_pi(rotors.angle(place, rotors.begin));
    }
    const auto at = std::find(fit.names.begin(), fit.names.end(), info.name);
    const auto row = static_cast<Eigen::Index>(at - fit.names.begin());
    // What was held at zero is no answer.
    if (at == fit.names.end() && info.kind == ParameterKind::train && value == 0) continue;
    const auto sigma = [&](const Eigen::MatrixXd& covariance) {
      if (row >= covariance.rows()) return std::nan("");
      return std::sqrt(std::max(0.0, covariance(row, row))) / info.si_per_unit;
    };
    values.push_back({info.name, info.unit, value / info.si_per_unit,
                      sigma(hypothesis.total_covariance), sigma(fit.covariance)});
  }
  return values;
}

Json hypothesis_json(const identification::Identification& found, const Hypothesis& hypothesis) {
  Json parameters = Json::object(), equivalent = Json::array(), lags = Json::array();
  for (const FittedValue& one : values_of(hypothesis)) {
    parameters[one.name] = {{"value", one.value},
                            {"sigma", number_or_null(one.sigma)},
                            {"sigma_given_held", number_or_null(one.sigma_given_held)}};
  }
  for (const std::size_t other : hypothesis.equivalent_to) {
    equivalent.push_back(to_string(found.hypotheses[other].train().face_order()));
  }
  for (const double lag : hypothesis.fit.model.lag) lags.push_back(lag);
  const estimation::FrameTurn& frame = hypothesis.fit.model.frame;
  return {{"faces", to_string(hypothesis.train().face_order())},
          {"parameters", parameters},
          {"rms_deg", degrees_from_radians(hypothesis.fit.rms)},
          {"chi2_excess", hypothesis.excess},
          {"equivalent_to", equivalent},
          {"emitter_lags_s", lags},
          {"frame",
           {{"yaw_deg", degrees_from_radians(frame.yaw)},
            {"pitch_deg", degrees_from_radians(frame.pitch)}}},
          {"observations_used", hypothesis.fit.shots},
          {"outliers", hypothesis.fit.outliers}};
}

Json outcome_json(const IdentifiedRecording& outcome) {
  const identification::Identification& found = outcome.identification;
  Json hypotheses = Json::array(), lines = Json::array();
  for (const Hypothesis& one : found.hypotheses) hypotheses.push_back(hypothesis_json(found, one));
  for (const identification::Line& line : found.spectrum.lines) {
    lines.push_back({{"frequency_hz", line.angular_velocity / kTwoPi},
                     {"amplitude", std::abs(line.amplitude)}});
  }
  Json object = {
      {"hypotheses", hypotheses},
      {"verdict",
       {{"code", to_string(outcome.verdict)}, {"words", outcome.words}, {"to_do", outcome.to_do}}},
      {"preset", nullptr},
      {"mirrored", outcome.like_mirrored},
      {"emitters", found.emitters},
      {"emitters_named", found.emitters_named},
      {"timing", to_string(found.timing)},
      {"decimation", outcome.sensor.decimation},
      {"shot_rate_hz", outcome.sensor.sensor.shot_rate},
      {"rotor_segments_s", found.motion.length},
      {"lines", lines},
      {"unobservable", outcome.unobservable},
      {"warnings", outcome.warnings},
      {"seconds", {{"read", outcome.reading_time}, {"solve", outcome.solving_time}}}};
  if (!outcome.like.empty()) object["preset"] = outcome.like;
  return object;
}

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
  for (const FittedValue& one : values_of(found.best())) {
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
  for (const std::string& words : outcome.unobservable) say("never told: {}.\n", words);
  if (!outcome.to_do.empty()) say("what to do: {}.\n", outcome.to_do);
}

ExitStatus run_identify(const IdentifyCommandOptions& options, const CommonOptions& common) {
  check_positive(options.fastest_hz, "--fastest-hz", "Hz");
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
  put_flags(outcome.warnings);
  for (const std::string& warning : outcome.warnings) spdlog::warn(warning);
  if (!options.output.empty() && !outcome.written) {
    spdlog::warn("{} was not written: {}; --force writes it all the same", options.output,
                 outcome.words);
  }
  if (common.json) {
    print_json(common, outcome_json(outcome), outcome.sensor.sensor.provenance);
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
  verb.add_flag("--force", o.force, "Write the preset even if the answer is not certain");
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
