// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "flight_text.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"

#include "calibration_text.hpp"
#include "recording_text.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

using calibration::FlightCalibration;
using calibration::FlightUnknown;
using calibration::FlightUnknowns;
using calibration::StripPair;
using jobs::CalibratedFlight;

double in_degrees(double radians) { return degrees_from_radians(radians); }

Json value_and_sigma(const FlightUnknown& unknown, TrainShape shape) {
  return {{"value", in_unit_of(unknown, unknown.value, shape)},
          {"sigma", number_or_null(in_unit_of(unknown, unknown.sigma, shape))}};
}

Json unknown_json(const FlightUnknown& unknown, TrainShape shape) {
  Json json = value_and_sigma(unknown, shape);
  json["before"] = in_unit_of(unknown, unknown.start, shape);
  json["held"] = unknown.held;
  if (unknown.held) return json;
  json["prior_sigma"] = number_or_null(in_unit_of(unknown, unknown.prior_sigma, shape));
  json["prior_share"] = unknown.prior_share;
  json["twin"] = unknown.twin;
  json["twin_correlation"] = unknown.twin_correlation;
  return json;
}

Json pair_json(const StripPair& pair) {
  return {
      {"cells", pair.cells},
      {"mean_m", pair.mean},
      {"rms_m", pair.rms},
      {"shift_m", {{"east", pair.shift.x()}, {"north", pair.shift.y()}, {"up", pair.shift.z()}}},
      {"shift_sigma_m",
       {{"east", pair.sigma.x()}, {"north", pair.sigma.y()}, {"up", pair.sigma.z()}}}};
}

const StripPair* find_pair(const std::vector<StripPair>& pairs, const StripPair& like) {
  const auto at = std::find_if(pairs.begin(), pairs.end(), [&](const StripPair& pair) {
    return pair.first == like.first && pair.second == like.second;
  });
  return at == pairs.end() ? nullptr : &*at;
}

Json strips_json(const CalibratedFlight& outcome) {
  const FlightCalibration& c = outcome.calibration;
  Json pairs = Json::array();
  for (const StripPair& after : c.pairs_after) {
    Json pair = {{"first", after.first + 1}, {"second", after.second + 1}};
    const StripPair* before = find_pair(c.pairs_before, after);
    pair["before"] = before == nullptr ? Json(nullptr) : pair_json(*before);
    pair["after"] = pair_json(after);
    pairs.push_back(std::move(pair));
  }
  Json shots = Json::array();
  for (const std::size_t rows : outcome.strip_rows) shots.push_back(rows);
  return {{"count", outcome.strips.size()},
          {"shots", shots},
          {"before", {{"rms_m", c.rms_before}}},
          {"after", {{"rms_m", c.rms_after}}},
          {"pairs", pairs}};
}

Json control_json(const FlightCalibration& c) {
  Json list = Json::array();
  for (const calibration::SeenControl& seen : c.control) {
    list.push_back({{"name", seen.name},
                    {"shots", seen.shots},
                    {"used", seen.used},
                    {"off_m", seen.used ? Json(seen.off) : Json(nullptr)},
                    {"sigma_m", seen.sigma},
                    {"significant", seen.significant}});
  }
  return list;
}

void print_control(const FlightCalibration& c) {
  if (c.control.empty()) return;
  say("\n");
  Table table({"known ground", "shots", "seen above it mm", "+- sigma mm"});
  for (const calibration::SeenControl& seen : c.control) {
    table.add({seen.name, grouped(seen.shots),
               seen.used ? fmt::format("{:+.1f}", 1e3 * seen.off) : "left out",
               fmt::format("{:.1f}", 1e3 * seen.sigma)});
  }
  table.print();
}

}  // namespace

double in_unit_of(const FlightUnknown& unknown, double value, TrainShape shape) {
  if (unknown.name.starts_with("boresight")) return in_degrees(value);
  const bool plain = unknown.name.starts_with("lever_arm") || unknown.name == "range_offset_m" ||
                     unknown.name == "clock_offset_s";
  return plain ? value : in_file_unit(unknown.name, value, shape);
}

std::string unit_of(const FlightUnknown& unknown, TrainShape shape) {
  if (unknown.name.starts_with("boresight")) return "deg";
  if (unknown.name == "clock_offset_s") return "s";
  if (unknown.name.starts_with("lever_arm") || unknown.name == "range_offset_m") return "m";
  return find_parameter(unknown.name, shape).unit;
}

Json judgement_json(const calibration::FlightJudgement& judgement, TrainShape shape) {
  Json unknowns = Json::object(), not_told = Json::array();
  for (const FlightUnknown& unknown : judgement.unknowns) {
    unknowns[unknown.name] = unknown_json(unknown, shape);
  }
  for (const calibration::NotTold& own : judgement.not_told) {
    not_told.push_back({{"combination", own.words}, {"sigma_over_before", own.sigma}});
  }
  const calibration::FlightDatum& datum = judgement.datum;
  return {{"unknowns", unknowns},
          {"datum",
           {{"sigma_x_deg", in_degrees(datum.sigma_x)},
            {"sigma_y_deg", in_degrees(datum.sigma_y)},
            {"sigma_z_deg", in_degrees(datum.sigma_z)},
            {"sigma_rotation_deg", in_degrees(datum.rotation)},
            {"sigma_shape_deg", in_degrees(datum.shape)},
            {"sigma_total_deg", in_degrees(datum.total)},
            {"height_m", datum.height},
            {"sigma_total_m", datum.total * datum.height}}},
          {"not_told", not_told}};
}

Json held_json(const FlightCalibration& c) {
  const TrainShape shape = c.sensor.shape();
  Json object = Json::object();
  for (const calibration::HeldParameter& held : c.held) {
    object[held.name] = {{"value", in_file_unit(held.name, held.held, shape)},
                         {"stated_sigma", in_file_unit(held.name, held.stated_sigma, shape)},
                         {"told", in_file_unit(held.name, held.told, shape)},
                         {"sigma", in_file_unit(held.name, held.sigma, shape)},
                         {"significant", held.significant}};
  }
  return object;
}

void print_judgement(const calibration::FlightJudgement& judgement) {
  const calibration::FlightDatum& datum = judgement.datum;
  say("boresight and prisms together: 1 sigma {:.2g} deg over the field of view ({:.2g} shared by "
      "all beams, {:.2g} in shape), {}\n",
      in_degrees(datum.total), in_degrees(datum.rotation), in_degrees(datum.shape),
      offset_text(datum.total, datum.height));
  for (const calibration::NotTold& own : judgement.not_told) {
    say("not told by this flight: {} (keeps {:.0f} % of its sigma)\n", own.words,
        100 * std::min(1.0, own.sigma));
  }
}

Json flight_json(const CalibratedFlight& outcome, double total_time) {
  const FlightCalibration& c = outcome.calibration;
  const TrainShape shape = c.sensor.shape();
  const auto stated = [&](int at) {
    return value_and_sigma(c.unknowns[static_cast<std::size_t>(at)], shape);
  };
  Json parameters = Json::object();
  for (std::size_t i = FlightUnknowns{}.size(); i < c.unknowns.size(); ++i) {
    parameters[c.unknowns[i].name] = unknown_json(c.unknowns[i], shape);
  }
  const Json judged = judgement_json(c, shape);
  std::vector<std::string> warnings = outcome.warnings;
  warnings.insert(warnings.end(), c.warnings.begin(), c.warnings.end());
  Json object = {{"serial", outcome.recordings.front().serial()},
                 {"verdict", verdict_json(c.verdict)},
                 {"converged", c.converged},
                 {"reason", c.reason},
                 {"observations", outcome.observations},
                 {"shots",
                  {{"on_strips", c.shots},
                   {"between_strips", outcome.outside_strips},
                   {"without_pose", c.without_pose},
                   {"used", c.used},
                   {"outliers", c.outliers}}},
                 {"boresight", {{"x_deg", stated(0)}, {"y_deg", stated(1)}, {"z_deg", stated(2)}}},
                 {"lever_arm_m",
                  {{"x", stated(FlightUnknowns::lever_arm(0))},
                   {"y", stated(FlightUnknowns::lever_arm(1))},
                   {"z", stated(FlightUnknowns::lever_arm(2))}}},
                 {"clock_offset_s", stated(FlightUnknowns::clock_offset())},
                 {"clock_drift_ppm",
                  {{"value", 1e6 * c.clock_drift.value},
                   {"sigma", 1e6 * c.clock_drift.sigma},
                   {"significant", c.clock_drift.significant}}},
                 {"range_offset_m", stated(FlightUnknowns::range_offset())},
                 {"held", held_json(c)},
                 {"parameters", parameters},
                 {"unknowns", judged["unknowns"]},
                 {"datum", judged["datum"]},
                 {"not_told", judged["not_told"]},
                 {"strips", strips_json(outcome)},
                 {"control", control_json(c)},
                 {"cells", c.cells},
                 {"rough_cells", c.rough_cells},
                 {"knots", c.model.knots.size()},
                 {"sigma0", c.sigma0},
                 {"range_sigma_m", c.range_sigma},
                 {"frame", frame_json()},
                 {"slips", slips_of_all(outcome.recordings)},
                 {"warnings", warnings},
                 {"seconds",
                  {{"read", outcome.reading_time},
                   {"rotation_angles", outcome.angles_time},
                   {"solve", outcome.solving_time},
                   {"total", total_time}}}};
  object.update(choice_json(outcome.choice));
  if (outcome.truth) {
    object["truth"] = {{"before", errors_json(outcome.truth->before)},
                       {"after", errors_json(outcome.truth->after)}};
  }
  return object;
}

void print_flight(const CalibratedFlight& outcome) {
  const FlightCalibration& c = outcome.calibration;
  const TrainShape shape = c.sensor.shape();
  say("{}\n", c.converged ? "converged" : "NOT CONVERGED");
  print_verdict(c.verdict);
  say("sensor {}: {}\n", outcome.choice.sensor.name, outcome.choice.words);
  say("{} shots on {} strips, {} cells of ground; read {:.2f} s, rotation angles {:.2f} s, solved "
      "{:.2f} s\n\n",
      grouped(c.used), outcome.strips.size(), grouped(c.cells), outcome.reading_time,
      outcome.angles_time, outcome.solving_time);
  Table table({"unknown", "value", "+- sigma", "unit", "before", "+- sigma", "share", "twin"});
  for (const FlightUnknown& unknown : c.unknowns) {
    if (unknown.held && !(unknown.sigma > 0)) continue;
    const NumberText text = number_text(in_unit_of(unknown, unknown.value, shape),
                                        in_unit_of(unknown, unknown.sigma, shape));
    const double before = in_unit_of(unknown, unknown.start, shape);
    const double prior = in_unit_of(unknown, unknown.prior_sigma, shape);
    std::vector<std::string> row = {
        unknown.name,
        text.value,
        text.sigma,
        unit_of(unknown, shape),
        text_to_place_of(before, in_unit_of(unknown, unknown.sigma, shape)),
        std::isfinite(prior) ? fmt::format("{:.2g}", prior) : "none"};
    if (unknown.held) {
      row.insert(row.end(), {"held", ""});
    } else {
      row.insert(row.end(), {fmt::format("{:.0f} %", 100 * unknown.prior_share),
                             unknown.twin.empty() ? std::string()
                                                  : fmt::format("{} {:+.2f}", unknown.twin,
                                                                unknown.twin_correlation)});
    }
    table.add(row);
  }
  table.print();
  say("\nshare: of the answer that comes from what was known before; twin: the unknown it is tied "
      "to most\n");
  print_judgement(c);
  say("strips apart along the ground's normals: {:.1f} mm before, {:.1f} mm after\n\n",
      1e3 * c.rms_before, 1e3 * c.rms_after);
  Table pairs({"strips", "cells", "before mm", "after mm", "east mm", "north mm", "up mm"});
  for (const StripPair& after : c.pairs_after) {
    const StripPair* before = find_pair(c.pairs_before, after);
    std::vector<std::string> row = {
        fmt::format("{} - {}", after.first + 1, after.second + 1), grouped(after.cells),
        before == nullptr ? "-" : fmt::format("{:.1f}", 1e3 * before->rms),
        fmt::format("{:.1f}", 1e3 * after.rms)};
    for (Eigen::Index k = 0; k < 3; ++k) {
      row.push_back(after.sigma[k] >= 1 ? "not told"
                                        : fmt::format("{:.1f} +- {:.1f}", 1e3 * after.shift[k],
                                                      1e3 * after.sigma[k]));
    }
    pairs.add(row);
  }
  pairs.print();
  print_control(c);
  if (!outcome.truth) return;
  say("\n");
  Table errors({"error, deg", "total", "shared rotation", "shape"});
  const auto add = [&errors](const char* name, const calibration::DirectionErrors& e) {
    errors.add({name, fmt::format("{:.5f}", in_degrees(e.total)),
                fmt::format("{:.5f}", in_degrees(e.gauge)),
                fmt::format("{:.5f}", in_degrees(e.shape))});
  };
  add("before", outcome.truth->before);
  add("after", outcome.truth->after);
  errors.print();
}

}  // namespace risley::app
