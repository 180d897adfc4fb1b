// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration_text.hpp"

#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/text.hpp"

#include "command.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

using calibration::Calibration;
using calibration::CalibrationForecast;
using calibration::DirectionErrors;
using calibration::FormalDatum;
using jobs::CalibratedRecordings;

double deg(double radians) { return degrees_from_radians(radians); }

void print_datum(calibration::DatumKind kind, const FormalDatum& datum) {
  say("datum: {}; 1 sigma of roll {}, pitch {}, yaw {} deg; of the beams against each other {} deg "
      "({})\n",
      calibration::to_string(kind), plain_text(deg(datum.sigma_roll), 2),
      plain_text(deg(datum.sigma_pitch), 2), plain_text(deg(datum.sigma_yaw), 2),
      plain_text(deg(datum.shape), 2), offset_text(datum.shape));
}

}  // namespace

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
  for (const calibration::CalibratedNumber& number : c.numbers) {
    const bool length = number.name.ends_with("_m");
    const double scale = length ? 1e3 : 1.0;
    const NumberText text = number_text(scale * number.value, scale * number.sigma);
    std::vector<std::string> row = {
        length ? number.name + "m" : number.name, text.value,
        number_text(scale * number.value, scale * number.total_sigma).sigma};
    if (any_held) row.push_back(text.sigma);
    row.insert(row.end(),
               {length ? "mm" : "1", text_to_place_of(scale * number.prior, scale * number.sigma)});
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
  if (c.shape.sigma > 0) {
    say("the walls wave by {:.1f} mm (1 sigma) over {:.1f} m\n", 1e3 * c.shape.sigma,
        c.shape.length);
  }
  if (c.same_walls) say("the recordings share these walls and their shape\n");
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
  say("error of a direction, from noise and the shape of the walls: {} deg ({})\n",
      plain_text(deg(f.datum.total), 2), offset_text(f.datum.total));
  if (f.rolled) {
    say("the same time in two poses, rolled by 180 degrees on the spot: {} deg ({})\n",
        plain_text(deg(f.rolled->total), 2), offset_text(f.rolled->total));
  }
  for (const auto& weak : f.unobservable) {
    say("not determined by these walls: {}\n", direction_text(weak));
  }
  for (const std::string& words : f.advice) say("advice: {}\n", words);
}

}  // namespace risley::app
