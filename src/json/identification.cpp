// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>

#include "risley/identification/fitted_values.hpp"
#include "risley/jobs/identify_recording.hpp"
#include "risley/json/results.hpp"

#include "json/parts.hpp"

namespace risley::json {
namespace {

using identification::Hypothesis;

Json hypothesis_json(const identification::Identification& found, const Hypothesis& hypothesis) {
  Json parameters = Json::object(), equivalent = Json::array(), lags = Json::array();
  for (const identification::FittedValue& one : identification::fitted_values(hypothesis)) {
    parameters[one.name] = {{"value", one.value},
                            {"sigma", number_or_null(one.sigma)},
                            {"sigma_given_held", number_or_null(one.sigma_given_held)}};
  }
  for (const std::size_t other : hypothesis.equivalent_to) {
    equivalent.push_back(to_string(found.hypotheses[other].train().face_order()));
  }
  for (const double lag : hypothesis.fit.model.lag) lags.push_back(lag);
  const estimation::FrameTurn& turn = hypothesis.fit.model.frame;
  return {{"faces", to_string(hypothesis.train().face_order())},
          {"parameters", parameters},
          {"rms_deg", deg(hypothesis.fit.rms)},
          {"chi2_excess", hypothesis.excess},
          {"equivalent_to", equivalent},
          {"emitter_lags_s", lags},
          {"frame",
           turn_json(hypothesis.train().layout().axis_up, 0.0, deg(turn.yaw), deg(turn.pitch))},
          {"observations_used", hypothesis.fit.shots},
          {"outliers", hypothesis.fit.outliers}};
}

}  // namespace

Json of(const jobs::IdentifiedRecording& found) {
  const identification::Identification& identified = found.identification;
  Json hypotheses = Json::array(), lines = Json::array();
  for (const Hypothesis& one : identified.hypotheses)
    hypotheses.push_back(hypothesis_json(identified, one));
  for (const identification::Line& line : identified.spectrum.lines) {
    lines.push_back({{"frequency_hz", line.angular_velocity / kTwoPi},
                     {"amplitude", std::abs(line.amplitude)}});
  }
  Json object = {
      {"hypotheses", hypotheses},
      {"verdict",
       {{"code", to_string(found.verdict)}, {"words", found.words}, {"to_do", found.to_do}}},
      {"preset", nullptr},
      {"mirrored", found.like_mirrored},
      {"emitters", identified.emitters},
      {"emitters_named", identified.emitters_named},
      {"timing", to_string(identified.timing)},
      {"decimation", found.sensor.decimation},
      {"shot_rate_hz", found.sensor.sensor.shot_rate},
      {"rotor_segments_s", identified.motion.length},
      {"lines", lines},
      {"unobservable", found.unobservable},
      {"warnings", of(found.warnings)},
      {"seconds", {{"read", found.reading_time}, {"solve", found.solving_time}}}};
  if (!found.like.empty()) object["preset"] = found.like;
  return object;
}

}  // namespace risley::json
