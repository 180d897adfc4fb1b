// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "plan_flight.hpp"

#include <utility>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/report/distribution_page.hpp"

#include "distribution_text.hpp"
#include "flight_text.hpp"
#include "result_folder.hpp"
#include "table.hpp"
#include "warning_log.hpp"

namespace risley::app {
namespace {

using calibration::FlightForecast;
using calibration::FlightUnknown;

void print_plan(const jobs::PlannedFlightResult& planned) {
  const FlightForecast& f = planned.forecast;
  const TrainShape shape = planned.sensor.shape();
  say("sensor {}, {} strips, {} shots at {:g} Hz on {} cells of ground that several strips see\n\n",
      planned.sensor.name, f.strips.size(), grouped(f.used), f.rate, grouped(f.cells));
  Table table({"unknown", "+- sigma", "unit", "before"});
  for (const FlightUnknown& unknown : f.unknowns) {
    if (unknown.held) continue;
    table.add(
        {unknown.name,
         fmt::format("{:.2g}", calibration::in_file_unit(unknown, unknown.sigma, shape)),
         calibration::file_unit(unknown, shape),
         fmt::format("{:.2g}", calibration::in_file_unit(unknown, unknown.prior_sigma, shape))});
  }
  table.print();
  say("\n");
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

ExitStatus run_flight_plan(jobs::PlanFlightOptions options, const std::string& plan,
                           const jobs::PlatformFiles& platform, const std::string& scene,
                           const std::string& page, const CommonOptions& common) {
  if (!platform.accuracy.empty() || !platform.crs.empty() || !platform.datum.empty()) {
    throw InvalidArgument(
        "--accuracy, --crs and --datum are for a trajectory that was flown: a plan has none");
  }
  require_apart(common, {page});
  jobs::load_flight_plan({plan, platform.mount, platform.errors, scene}, options);
  jobs::PlannedFlightResult planned;
  {
    ProgressBar bar("planning", common);
    planned = jobs::plan_flight(options, bar.progress());
  }
  log_warnings(planned.warnings);
  log_warnings(planned.forecast.warnings);
  if (!page.empty()) {
    if (!planned.distribution) throw InvalidArgument("--report: there are no points to draw");
    write_page_file(page,
                    report::distribution_page(
                        *planned.distribution,
                        fmt::format("{}, {}", options.plan.name.empty() ? plan : options.plan.name,
                                    planned.sensor.name),
                        provenance_of(common)));
  }
  if (common.json) {
    Json json = json::of(planned);
    if (!page.empty()) json["html"] = page;
    print_json(common, json);
  } else {
    print_plan(planned);
    if (!page.empty()) say("page: {}\n", page);
  }
  return kDone;
}

}  // namespace risley::app
