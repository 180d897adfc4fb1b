// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration_text.hpp"

#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"

#include "observability_text.hpp"
#include "recording_text.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

using calibration::Calibration;
using calibration::CalibrationForecast;
using calibration::DirectionErrors;
using calibration::FormalDatum;
using jobs::CalibratedRecordings;

double deg(double radians) { return degrees_from_radians(radians); }

Json datum_json(calibration::DatumKind kind, const FormalDatum& datum) {
  return {{"kind", calibration::to_string(kind)},      {"sigma_roll_deg", deg(datum.sigma_roll)},
          {"sigma_pitch_deg", deg(datum.sigma_pitch)}, {"sigma_yaw_deg", deg(datum.sigma_yaw)},
          {"sigma_gauge_deg", deg(datum.gauge)},       {"sigma_shape_deg", deg(datum.shape)},
          {"sigma_total_deg", deg(datum.total)}};
}

Json vector_json(const Vector3<double>& v) { return {v.x, v.y, v.z}; }

Json unobservable_json(const std::vector<estimation::WeakDirection>& directions) {
  Json list = Json::array();
  for (const auto& direction : directions) list.push_back(weak_direction_json(direction));
  return list;
}

void print_datum(calibration::DatumKind kind, const FormalDatum& datum) {
  say("datum: {}; 1 sigma of roll {}, pitch {}, yaw {} deg; of the beams against each other {} deg "
      "({})\n",
      calibration::to_string(kind), plain_text(deg(datum.sigma_roll), 2),
      plain_text(deg(datum.sigma_pitch), 2), plain_text(deg(datum.sigma_yaw), 2),
      plain_text(deg(datum.shape), 2), offset_text(datum.shape));
}

}  // namespace

Json pointing_json(const calibration::PointingError& pointing) {
  const DirectionErrors& errors = pointing.errors;
  const auto known = [](double value, double sigma) {
    return Json{{"value", deg(value)}, {"sigma", number_or_null(deg(sigma))}};
  };
  return {{"total_deg", known(errors.total, pointing.total_sigma)},
          {"shared_deg", known(errors.gauge, pointing.gauge_sigma)},
          {"shape_deg", known(errors.shape, pointing.shape_sigma)},
          {"worst_deg", known(pointing.worst_shape, pointing.worst_shape_sigma)},
          {"rotation_deg",
           {{"roll", deg(errors.rotation.x)},
            {"pitch", deg(errors.rotation.y)},
            {"yaw", deg(errors.rotation.z)}}}};
}

Json slips_of_all(const std::vector<jobs::ReadRecording>& recordings) {
  Json all = Json::array();
  for (const jobs::ReadRecording& recording : recordings) {
    for (Json& slip : slips_json(recording.header.slips)) {
      slip["recording"] = recording.path;
      all.push_back(std::move(slip));
    }
  }
  return all;
}

Json errors_json(const DirectionErrors& e) {
  return {{"azimuth_rmse_deg", deg(e.azimuth_rmse)},
          {"zenith_rmse_deg", deg(e.zenith_rmse)},
          {"azimuth_bias_deg", deg(e.azimuth_bias)},
          {"zenith_bias_deg", deg(e.zenith_bias)},
          {"total_deg", deg(e.total)},
          {"gauge_deg", deg(e.gauge)},
          {"shape_deg", deg(e.shape)}};
}

Json calibration_json(const CalibratedRecordings& outcome, double total_time) {
  const Calibration& c = outcome.calibration;
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
    planes.push_back({{"name", plane.name},
                      {"recording", outcome.recordings[plane.recording].path},
                      {"normal", vector_json(plane.normal)},
                      {"offset_m", plane.distance},
                      {"points", plane.points},
                      {"outliers", plane.outliers},
                      {"rms_m", plane.rms},
                      {"before_rms_m", plane.rms_before},
                      {"range_sigma_m", plane.range_sigma}});
  }
  for (const calibration::SurfaceStep& step : c.steps) {
    steps.push_back({{"recording", outcome.recordings[step.recording].path},
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
  std::vector<std::string> warnings = outcome.warnings;
  warnings.insert(warnings.end(), c.warnings.begin(), c.warnings.end());
  Json object = {
      {"serial", outcome.recordings.front().serial()},
      {"verdict", verdict_json(c.verdict)},
      {"converged", c.converged},
      {"reason", c.reason},
      {"method", c.method == calibration::CalibrationMethod::paper ? "paper" : "adjustment"},
      {"iterations", c.iterations},
      {"observations", outcome.observations},
      {"points", c.points},
      {"parameters", parameters},
      {"range_offset_m",
       {{"value", c.range_offset},
        {"sigma", c.range_offset_total_sigma()},
        {"sigma_given_held", c.range_offset_sigma}}},
      {"planes", planes},
      {"steps", steps},
      {"datum", datum_json(c.datum_kind, c.datum)},
      {"datum_given_held", datum_json(c.datum_kind, c.datum_given_held)},
      {"pointing_error", pointing_json(c.pointing_error)},
      {"better_probability", number_or_null(c.better_probability)},
      {"prior_tests", tests},
      {"unobservable", unobservable_json(c.unobservable)},
      {"before", {{"plane_rms_m", c.rms_before}}},
      {"after", {{"plane_rms_m", c.rms_after}}},
      {"sigma0", c.sigma0},
      {"unevenness", c.unevenness},
      {"variance_factor", c.variance_factor},
      {"thickness", profiles},
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

void print_calibration(const CalibratedRecordings& outcome) {
  const Calibration& c = outcome.calibration;
  const TrainShape shape = c.sensor.shape();
  say("{}\n", c.converged ? "converged" : "NOT CONVERGED");
  print_verdict(c.verdict);
  say("sensor {}: {}\n", outcome.choice.sensor.name, outcome.choice.words);
  say("{} points on {} plane{}, {:.2f} mm thick before, {:.2f} mm after; read {:.2f} s, rotation "
      "angles {:.2f} s, solved {:.2f} s\n\n",
      grouped(c.points), c.planes.size(), c.planes.size() == 1 ? "" : "s", 1e3 * c.rms_before,
      1e3 * c.rms_after, outcome.reading_time, outcome.angles_time, outcome.solving_time);
  const bool any_held = c.held_changes.cols() > 0;
  std::vector<std::string> head = {"parameter", "value", "+- sigma", "unit", "before"};
  if (any_held) head.insert(head.begin() + 3, "given held");
  if (outcome.truth) head.insert(head.end(), {"truth", "error/sigma"});
  Table table(head);
  for (std::size_t j = 0; j < c.free.size(); ++j) {
    const std::string& name = c.free[j].name;
    const auto at = static_cast<Eigen::Index>(j);
    const double sigma = in_file_unit(name, std::sqrt(c.covariance(at, at)), shape);
    const double value = in_file_unit(name, c.parameters[at], shape);
    const NumberText text = number_text(value, sigma);
    const double total_sigma = in_file_unit(name, c.total_sigma(j), shape);
    std::vector<std::string> row = {name, text.value, number_text(value, total_sigma).sigma};
    if (any_held) row.push_back(text.sigma);
    row.push_back(find_parameter(name, shape).unit);
    row.push_back(text_to_place_of(in_file_unit(name, c.believed.get(name), shape), sigma));
    if (outcome.truth) {
      const double truth = in_file_unit(name, outcome.truth->truth.get(name), shape);
      row.push_back(text_to_place_of(truth, sigma));
      row.push_back(fmt::format("{:.2f}", (value - truth) / total_sigma));
    }
    table.add(row);
  }
  if (c.range_offset_sigma > 0) {
    const NumberText text = number_text(1e3 * c.range_offset, 1e3 * c.range_offset_sigma);
    std::vector<std::string> row = {
        "range offset", text.value,
        number_text(1e3 * c.range_offset, 1e3 * c.range_offset_total_sigma()).sigma};
    if (any_held) row.push_back(text.sigma);
    row.insert(row.end(), {"mm", "0"});
    table.add(row);
  }
  table.print();
  say("\n");
  Table planes({"plane", "recording", "distance m", "points", "outliers", "before mm", "after mm"});
  for (const calibration::CalibratedPlane& plane : c.planes) {
    planes.add({plane.name,
                std::filesystem::path(outcome.recordings[plane.recording].path).filename().string(),
                fmt::format("{:.3f}", plane.distance), grouped(plane.points),
                grouped(plane.outliers), fmt::format("{:.2f}", 1e3 * plane.rms_before),
                fmt::format("{:.2f}", 1e3 * plane.rms)});
  }
  planes.print();
  say("\n");
  print_datum(c.datum_kind, c.datum);
  for (const calibration::PriorTest& test : c.prior_tests) {
    if (test.degrees_of_freedom == 0) {
      say("{} {}: not tested by these data\n", test.station ? "station" : "plane", test.name);
      continue;
    }
    say("{} {}: misfit {:.3g} deg, chi2 {:.3g}, limit {:.3g}\n", test.station ? "station" : "plane",
        test.name, deg(test.misfit), test.chi2, test.critical);
  }
  if (outcome.truth) {
    say("\n");
    Table errors({"error, deg", "azimuth rmse", "zenith rmse", "total", "shared rotation", "shape",
                  fmt::format("total at {:.0f} m, mm", kStatedDistance)});
    const auto add = [&errors](const char* name, const DirectionErrors& e) {
      errors.add({name, fmt::format("{:.5f}", deg(e.azimuth_rmse)),
                  fmt::format("{:.5f}", deg(e.zenith_rmse)), fmt::format("{:.5f}", deg(e.total)),
                  fmt::format("{:.5f}", deg(e.gauge)), fmt::format("{:.5f}", deg(e.shape)),
                  fmt::format("{:.1f}", 1e3 * offset_at(e.total))});
    };
    add("before", outcome.truth->before);
    add("after", outcome.truth->after);
    errors.print();
  }
}

Json plan_head(const std::string& sensor) {
  return {{"serial", nullptr},
          {"sensor", sensor},
          {"verdict",
           {{"code", "undecided"},
            {"words", "this is a plan: nothing was measured"},
            {"to_do", "record as planned, and calibrate from that"}}}};
}

Json forecast_json(const jobs::PlannedCalibration& planned) {
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
                 {"advice", f.advice}});
  return object;
}

void print_forecast(const CalibrationForecast& f, TrainShape shape) {
  say("{:.3g} shots meet a wall\n\n", f.shots);
  Table walls({"wall", "station", "share %", "incidence deg", "range m"});
  for (const calibration::PlannedWall& wall : f.walls) {
    walls.add({wall.name, wall.station, fmt::format("{:.1f}", 100 * wall.share),
               fmt::format("{:.1f}", deg(wall.mean_incidence)),
               fmt::format("{:.1f}", wall.mean_range)});
  }
  walls.print();
  say("\n");
  Table table({"parameter", "sigma", "unit"});
  for (std::size_t j = 0; j < f.free.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    const std::string& name = f.free[j].name;
    table.add({name,
               fmt::format("{:.2g}", in_file_unit(name, std::sqrt(f.covariance(at, at)), shape)),
               find_parameter(name, shape).unit});
  }
  table.print();
  say("\n");
  print_datum(f.datum_kind, f.datum);
  say("error of a direction by noise alone: {} deg ({})\n", plain_text(deg(f.datum.total), 2),
      offset_text(f.datum.total));
  for (const auto& weak : f.unobservable) {
    say("not told by these walls: {}\n", direction_text(weak));
  }
  for (const std::string& words : f.advice) say("advice: {}\n", words);
}

}  // namespace risley::app
