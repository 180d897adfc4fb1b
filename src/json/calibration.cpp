// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>
#include <string_view>

#include "risley/jobs/calibrate_recordings.hpp"
#include "risley/jobs/plan_calibration.hpp"
#include "risley/json/results.hpp"

#include "json/parts.hpp"

namespace risley::json {
namespace {

using calibration::Calibration;
using calibration::CalibrationForecast;
using calibration::FormalDatum;

Json datum_json(calibration::DatumKind kind, const FormalDatum& datum) {
  Json object = {{"kind", calibration::to_string(kind)}};
  object.update(of(datum));
  return object;
}

Json direction_json(const Vector3<double>& v) { return {v.x, v.y, v.z}; }

Json unobservable_json(const std::vector<estimation::WeakDirection>& directions) {
  Json list = Json::array();
  for (const auto& direction : directions) list.push_back(weak_direction_json(direction));
  return list;
}

Json number_json(const calibration::CalibratedNumber& number) {
  return {{"value", number.value},
          {"sigma", number_or_null(number.total_sigma)},
          {"sigma_given_held", number_or_null(number.sigma)},
          {"prior_sigma", number_or_null(number.prior_sigma)}};
}

/// By their names in presets, less their "range_"; the offset is the constant.
Json ranges_json(const Calibration& c) {
  Json ranges = Json::object();
  constexpr std::string_view kPrefix = "range_";
  for (const calibration::CalibratedNumber& number : c.numbers) {
    if (!number.name.starts_with(kPrefix)) continue;
    const bool constant = number.name == "range_offset_m";
    ranges[constant ? "constant_m" : number.name.substr(kPrefix.size())] = number_json(number);
  }
  return ranges;
}

Json sizes_json(const Calibration& c) {
  Json sizes = Json::object();
  for (const calibration::CalibratedNumber& number : c.numbers) {
    if (number.name.starts_with("prism_")) sizes[number.name] = number_json(number);
  }
  return sizes;
}

}  // namespace

Json of(const FormalDatum& datum) {
  return {{"sigma_roll_deg", deg(datum.sigma_roll)}, {"sigma_pitch_deg", deg(datum.sigma_pitch)},
          {"sigma_yaw_deg", deg(datum.sigma_yaw)},   {"sigma_gauge_deg", deg(datum.gauge)},
          {"sigma_shape_deg", deg(datum.shape)},     {"sigma_total_deg", deg(datum.total)}};
}

Json of(const jobs::CalibratedRecordings& found) {
  const Calibration& c = found.calibration;
  const TrainShape shape = c.sensor.shape();
  Json parameters = Json::object(), planes = Json::array(), steps = Json::array(),
       tests = Json::array(), profiles = Json::object();
  for (std::size_t j = 0; j < c.free.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    parameters[c.free[j].name] = {
        {"value", in_file_unit(c.free[j].name, c.parameters[at], shape)},
        {"sigma", number_or_null(in_file_unit(c.free[j].name, c.total_sigma(j), shape))},
        {"sigma_given_held",
         number_or_null(in_file_unit(c.free[j].name, std::sqrt(c.covariance(at, at)), shape))}};
  }
  for (const calibration::CalibratedPlane& plane : c.planes) {
    planes.push_back(
        {{"name", plane.name},
         {"recording", found.recordings[plane.recording].path},
         {"normal", direction_json(plane.normal)},
         {"offset_m", plane.distance},
         {"points", plane.points},
         {"outliers", plane.outliers},
         {"rms_m", plane.rms},
         {"before_rms_m", plane.rms_before},
         {"range_sigma_m", plane.range_sigma},
         {"shape", {{"sigma_m", plane.shape_sigma}, {"length_m", plane.shape_length}}}});
  }
  for (const calibration::SurfaceStep& step : c.steps) {
    steps.push_back({{"recording", found.recordings[step.recording].path},
                     {"plane", c.planes[step.plane].name},
                     {"height_m", step.height},
                     {"azimuth_deg", deg(step.azimuth)},
                     {"zenith_deg", deg(step.zenith)},
                     {"size_deg", deg(step.size)},
                     {"points", step.points}});
  }
  for (const calibration::PriorTest& test : c.prior_tests) {
    tests.push_back({{"name", test.name},
                     {"kind", test.station ? "station" : "plane"},
                     {"misfit_deg", deg(test.misfit)},
                     {"chi2", test.chi2},
                     {"degrees_of_freedom", test.degrees_of_freedom},
                     {"critical", test.critical}});
  }
  for (const calibration::ThicknessProfile& profile : c.profiles) {
    Json rows = Json::array();
    for (std::size_t i = 0; i < profile.count.size(); ++i) {
      if (profile.count[i] == 0) continue;
      rows.push_back({{"from_deg", deg(profile.from[i])},
                      {"to_deg", deg(profile.to[i])},
                      {"points", profile.count[i]},
                      {"before_rms_m", profile.rms_before[i]},
                      {"after_rms_m", profile.rms_after[i]}});
    }
    profiles[profile.variable] = rows;
  }
  const calibration::CalibratedNumber* offset = c.number("range_offset_m");
  Json object = {
      {"serial", found.recordings.front().serial()},
      {"verdict", verdict_json(c.verdict)},
      {"converged", c.converged},
      {"reason", c.reason},
      {"method", c.method == calibration::CalibrationMethod::paper ? "paper" : "adjustment"},
      {"iterations", c.iterations},
      {"observations", found.observations},
      {"points", c.points},
      {"parameters", parameters},
      {"range_offset_m", offset ? number_json(*offset)
                                : Json{{"value", c.sensor.range_offset},
                                       {"sigma", 0},
                                       {"sigma_given_held", 0},
                                       {"prior_sigma", 0}}},
      {"ranges", ranges_json(c)},
      {"sizes", sizes_json(c)},
      {"same_walls", c.same_walls},
      {"planes", planes},
      {"steps", steps},
      {"datum", datum_json(c.datum_kind, c.datum)},
      {"datum_given_held", datum_json(c.datum_kind, c.datum_given_held)},
      {"pointing_error", pointing_json(c.pointing_error)},
      {"tolerance_deg", tolerance_json(c.tolerance)},
      {"beyond_tolerance_probability",
       c.tolerance > 0
           ? number_or_null(calibration::beyond_probability(
                 c.pointing_error.errors.total, c.pointing_error.total_sigma, c.tolerance))
           : Json()},
      {"better_probability", number_or_null(c.better_probability)},
      {"calibration_written", found.calibration_written},
      {"prior_tests", tests},
      {"unobservable", unobservable_json(c.unobservable)},
      {"before", {{"plane_rms_m", c.rms_before}}},
      {"after", {{"plane_rms_m", c.rms_after}}},
      {"sigma0", c.sigma0},
      {"shape",
       {{"sigma_m", c.shape.sigma}, {"length_m", c.shape.length}, {"white_m", c.shape.white}}},
      {"thickness", profiles}};
  add_end(found, object);
  return object;
}

Json of(const jobs::PlannedCalibration& planned) {
  const CalibrationForecast& f = planned.forecast;
  const TrainShape shape = planned.shape;
  Json parameters = Json::object(), walls = Json::array();
  for (std::size_t j = 0; j < f.free.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    parameters[f.free[j].name] = {
        {"sigma",
         number_or_null(in_file_unit(f.free[j].name, std::sqrt(f.covariance(at, at)), shape))}};
  }
  for (const calibration::PlannedWall& wall : f.walls) {
    walls.push_back({{"name", wall.name},
                     {"station", wall.station},
                     {"share", wall.share},
                     {"mean_incidence_deg", deg(wall.mean_incidence)},
                     {"mean_range_m", wall.mean_range}});
  }
  Json object = plan_head(planned.sensor);
  object.update({{"parameters", parameters},
                 {"range_offset_m", {{"sigma", number_or_null(f.range_offset_sigma)}}},
                 {"datum", datum_json(f.datum_kind, f.datum)},
                 {"unobservable", unobservable_json(f.unobservable)},
                 {"walls", walls},
                 {"observations", f.shots},
                 {"rolled_180_deg",
                  f.rolled ? datum_json(calibration::DatumKind::none, *f.rolled) : Json(nullptr)},
                 {"advice", f.advice}});
  return object;
}

}  // namespace risley::json
