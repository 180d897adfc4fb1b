// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "plan_flight.hpp"

#include <sstream>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"
#include "risley/report/distribution_page.hpp"
#include "risley/scenes/scene.hpp"

#include "calibration_text.hpp"
#include "distribution_text.hpp"
#include "flight_text.hpp"
#include "recording_text.hpp"
#include "result_folder.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

using calibration::FlightForecast;
using calibration::FlightUnknown;

Json lengths_json(const Eigen::Vector3d& v) {
  return {{"east", number_or_null(v.x())},
          {"north", number_or_null(v.y())},
          {"up", number_or_null(v.z())}};
}

Json plan_json(const jobs::PlannedFlightResult& planned) {
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
  std::vector<std::string> warnings = planned.warnings;
  warnings.insert(warnings.end(), f.warnings.begin(), f.warnings.end());
  json["warnings"] = warnings;
  return json;
}

void print_plan(const jobs::PlannedFlightResult& planned) {
  const FlightForecast& f = planned.forecast;
  const TrainShape shape = planned.sensor.shape();
  say("sensor {}, {} strips, {} shots at {:g} Hz on {} cells of ground that several strips see\n\n",
      planned.sensor.name, f.strips.size(), grouped(f.used), f.rate, grouped(f.cells));
  Table table({"unknown", "+- sigma", "unit", "before", "share", "twin"});
  for (const FlightUnknown& unknown : f.unknowns) {
    if (unknown.held) continue;
    table.add({unknown.name, fmt::format("{:.2g}", in_unit_of(unknown, unknown.sigma, shape)),
               unit_of(unknown, shape),
               fmt::format("{:.2g}", in_unit_of(unknown, unknown.prior_sigma, shape)),
               fmt::format("{:.0f} %", 100 * unknown.prior_share),
               unknown.twin.empty()
                   ? std::string()
                   : fmt::format("{} {:+.2f}", unknown.twin, unknown.twin_correlation)});
  }
  table.print();
  say("\nshare: of the answer that comes from what was known before; twin: the unknown it is tied "
      "to most\n");
  print_judgement(f);
  const auto& p = f.points;
  if (p.pairs > 0) {
    const auto mm = [](const Eigen::Vector3d& v) {
      return fmt::format("{:.1f} / {:.1f} / {:.1f}", 1e3 * v.x(), 1e3 * v.y(), 1e3 * v.z());
    };
    say("points of this flight, east / north / up: {} mm by the trajectory, {} mm adjusted\n",
        mm(p.trajectory), mm(p.adjusted));
    say("strip against strip: {} mm by the trajectory, {} mm adjusted\n", mm(p.strips_trajectory),
        mm(p.strips_adjusted));
  }
  if (planned.distribution) {
    say("\n");
    print_distribution(*planned.distribution);
  }
}

}  // namespace

bool is_flight_plan(const std::string& path) {
  std::istringstream lines(io::read_text_file(path));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("strips:") || line.starts_with("risley_flight:")) return true;
  }
  return false;
}

ExitStatus run_flight_plan(jobs::PlanFlightOptions options, const std::string& plan,
                           const jobs::PlatformFiles& platform, const std::string& scene,
                           const std::string& page, const CommonOptions& common) {
  options.plan = trajectories::load_flight_plan(plan);
  if (platform.mount.empty()) {
    throw InvalidArgument(
        "--mount is missing: a file that says how the sensor sits on the platform, and by its "
        "sigmas how well that is known before the flight");
  }
  if (platform.errors.empty()) {
    throw InvalidArgument(
        "--trajectory-errors is missing: a file that says how wrong the trajectory of the flight "
        "will be, and for how long");
  }
  if (!platform.accuracy.empty() || !platform.crs.empty() || !platform.datum.empty()) {
    throw InvalidArgument(
        "--accuracy, --crs and --datum are of a trajectory that was flown: a plan has none");
  }
  require_apart(common, {page});
  options.mount = trajectories::load_mount(platform.mount);
  options.errors = trajectories::load_error_model(platform.errors);
  if (!scene.empty()) {
    const scenes::Scene loaded = scenes::load_scene(scene);
    if (!loaded.terrain) {
      throw InvalidArgument(
          fmt::format("{} has no terrain to fly over: give it terrain: {{ground: ...}}", scene));
    }
    options.terrain = loaded.terrain->parts();
  }
  jobs::PlannedFlightResult planned;
  {
    ProgressBar bar("planning", common);
    planned = jobs::plan_flight(options, bar.progress());
  }
  put_flags(planned.warnings);
  for (const std::string& warning : planned.warnings) spdlog::warn(warning);
  for (const std::string& warning : planned.forecast.warnings) spdlog::warn(warning);
  if (!page.empty()) {
    if (!planned.distribution) throw InvalidArgument("--report: there are no points to draw");
    io::write_text_file(
        page, report::distribution_page(
                  *planned.distribution,
                  fmt::format("{}, {}", options.plan.name.empty() ? plan : options.plan.name,
                              planned.sensor.name),
                  provenance_of(common)));
  }
  if (common.json) {
    Json json = plan_json(planned);
    if (!page.empty()) json["html"] = page;
    print_json(common, json);
  } else {
    print_plan(planned);
    if (!page.empty()) say("page: {}\n", page);
  }
  return kDone;
}

}  // namespace risley::app
