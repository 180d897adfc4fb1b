// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>

#include "risley/jobs/calibrate_flight.hpp"
#include "risley/jobs/plan_flight.hpp"
#include "risley/json/results.hpp"

#include "json/parts.hpp"

namespace risley::json {
namespace {

using calibration::FlightCalibration;
using calibration::FlightForecast;
using calibration::FlightUnknown;
using calibration::FlightUnknowns;
using calibration::StripPair;
using jobs::CalibratedFlight;

Json value_and_sigma(const FlightUnknown& unknown, TrainShape shape) {
  return {{"value", calibration::in_file_unit(unknown, unknown.value, shape)},
          {"sigma", number_or_null(calibration::in_file_unit(unknown, unknown.sigma, shape))}};
}

Json unknown_json(const FlightUnknown& unknown, TrainShape shape) {
  Json json = value_and_sigma(unknown, shape);
  json["before"] = calibration::in_file_unit(unknown, unknown.start, shape);
  json["held"] = unknown.held;
  json["prior_sigma"] =
      number_or_null(calibration::in_file_unit(unknown, unknown.prior_sigma, shape));
  if (unknown.held) return json;
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

Json strips_json(const CalibratedFlight& found) {
  const FlightCalibration& c = found.calibration;
  Json pairs = Json::array();
  const auto add = [&](const StripPair& pair) {
    const auto end = [&](const std::vector<StripPair>& all) {
      const StripPair* own = find_pair(all, pair);
      return own == nullptr ? Json(nullptr) : pair_json(*own);
    };
    pairs.push_back({{"first", pair.first + 1},
                     {"second", pair.second + 1},
                     {"before", end(c.pairs_before)},
                     {"after", end(c.pairs_after)}});
  };
  for (const StripPair& pair : c.pairs_after) add(pair);
  for (const StripPair& pair : c.pairs_before) {
    if (find_pair(c.pairs_after, pair) == nullptr) add(pair);
  }
  Json shots = Json::array();
  for (const std::size_t rows : found.strip_rows) shots.push_back(rows);
  return {{"count", found.strips.size()},
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
           {{"sigma_x_deg", deg(datum.sigma_x)},
            {"sigma_y_deg", deg(datum.sigma_y)},
            {"sigma_z_deg", deg(datum.sigma_z)},
            {"sigma_rotation_deg", deg(datum.rotation)},
            {"sigma_shape_deg", deg(datum.shape)},
            {"sigma_total_deg", deg(datum.total)},
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
                         {"told", in_file_unit(held.name, held.from_flight, shape)},
                         {"sigma", in_file_unit(held.name, held.sigma, shape)},
                         {"significant", held.significant}};
  }
  return object;
}

/// One value for each of the six errors of a trajectory, lengths in m, angles in degrees.
template <class Value>
Json errors_json(const Value& value) {
  static constexpr const char* kNames[calibration::kCorrections] = {
      "east", "north", "up", "tilt_east", "tilt_north", "heading"};
  Json object = Json::object();
  for (int c = 0; c < calibration::kCorrections; ++c) object[kNames[c]] = value(c);
  return object;
}

Json trajectory_fit_json(const FlightCalibration& c) {
  const calibration::TrajectoryFit& fit = c.trajectory_fit;
  const auto& times = c.model.knots.time_ns;
  const std::int64_t begin_ns = times.empty() ? 0 : times.front();
  Json jumps = Json::array();
  for (const calibration::TrajectoryJump& jump : fit.jumps) {
    const auto since = [&](std::int64_t time_ns) { return 1e-9 * double(time_ns - begin_ns); };
    const auto in_unit = [](int error, double value) { return error < 3 ? value : deg(value); };
    jumps.push_back({{"begin_s", since(jump.begin_ns)},
                     {"end_s", since(jump.end_ns)},
                     {"strip", jump.strip + 1},
                     {"between_strips", jump.between_strips},
                     {"sigmas", jump.score},
                     {"size", errors_json([&](int e) {
                        const auto at = static_cast<std::size_t>(e);
                        return Json{{"value", in_unit(e, jump.size[at])},
                                    {"sigma", in_unit(e, jump.sigma[at])}};
                      })}});
  }
  return {{"fits", fit.fits},
          {"errors", errors_json([&](int e) {
             const auto at = static_cast<std::size_t>(e);
             return Json{{"chi2", fit.chi2[at]},
                         {"expected", fit.expected[at]},
                         {"factor", fit.factor[at]}};
           })},
          {"jumps", jumps}};
}

Json lengths_json(const Eigen::Vector3d& v) {
  return {{"east", number_or_null(v.x())},
          {"north", number_or_null(v.y())},
          {"up", number_or_null(v.z())}};
}

}  // namespace

Json of(const jobs::CalibratedFlight& found) {
  const FlightCalibration& c = found.calibration;
  const TrainShape shape = c.sensor.shape();
  const auto stated = [&](int at) {
    return value_and_sigma(c.unknowns[static_cast<std::size_t>(at)], shape);
  };
  Json parameters = Json::object();
  for (std::size_t i = FlightUnknowns{}.size(); i < c.unknowns.size(); ++i) {
    parameters[c.unknowns[i].name] = unknown_json(c.unknowns[i], shape);
  }
  const Json judged = judgement_json(c, shape);
  Json object = {{"serial", found.recordings.front().serial()},
                 {"verdict", verdict_json(c.verdict)},
                 {"converged", c.converged},
                 {"reason", c.reason},
                 {"observations", found.observations},
                 {"shots",
                  {{"on_strips", c.shots},
                   {"between_strips", found.outside_strips},
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
                 {"clock_contradicts", c.clock_contradicts},
                 {"attitude_delay_s",
                  {{"value", c.attitude_delay.value},
                   {"sigma", c.attitude_delay.sigma},
                   {"significant", c.attitude_delay.significant}}},
                 {"trajectory", trajectory_fit_json(c)},
                 {"range_offset_m", stated(FlightUnknowns::range_offset())},
                 {"held", held_json(c)},
                 {"parameters", parameters},
                 {"unknowns", judged["unknowns"]},
                 {"datum", judged["datum"]},
                 {"not_told", judged["not_told"]},
                 {"pointing_error", pointing_json(c.pointing_error)},
                 {"tolerance_deg", tolerance_json(c.tolerance)},
                 {"calibration_written", found.calibration_written},
                 {"strips", strips_json(found)},
                 {"control", control_json(c)},
                 {"cells", c.cells},
                 {"rough_cells", c.rough_cells},
                 {"knots", c.model.knots.size()},
                 {"sigma0", c.sigma0},
                 {"range_sigma_m", c.range_sigma},
                 {"roughness_m", c.roughness}};
  add_end(found, object);
  return object;
}

Json of(const jobs::PlannedFlightResult& planned) {
  const FlightForecast& f = planned.forecast;
  Json json = plan_head(planned.sensor.name);
  json.update(judgement_json(f, planned.sensor.shape()));
  Json strips = Json::array();
  for (std::size_t s = 0; s < f.strips.size(); ++s) {
    strips.push_back({{"name", f.strips[s].name},
                      {"duration_s", 1e-9 * double(f.strips[s].end_ns - f.strips[s].begin_ns)},
                      {"shots", f.strip_shots[s]}});
  }
  json["points"] = {{"trajectory_m", lengths_json(f.points.trajectory)},
                    {"adjusted_m", lengths_json(f.points.adjusted)},
                    {"strips_trajectory_m", lengths_json(f.points.strips_trajectory)},
                    {"strips_adjusted_m", lengths_json(f.points.strips_adjusted)},
                    {"places", f.points.places},
                    {"pairs", f.points.pairs}};
  json["rate_hz"] = f.rate;
  json["shots"] = {{"fired", f.fired}, {"on_terrain", f.shots}, {"used", f.used}};
  json["cells"] = f.cells;
  json["rough_cells"] = f.rough_cells;
  json["cell_size_m"] = f.cell_size;
  json["knot_spacing_s"] = f.knot_spacing;
  json["strips"] = strips;
  json["distribution"] =
      planned.distribution ? distribution_json(*planned.distribution) : Json(nullptr);
  json["warnings"] = all_warnings(planned.warnings, f.warnings);
  return json;
}

}  // namespace risley::json
