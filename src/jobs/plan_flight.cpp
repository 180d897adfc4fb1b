// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/plan_flight.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/io/text_file.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/jobs/moving_platform.hpp"
#include "risley/scenes/scene.hpp"
#include "risley/sensors/preset.hpp"

#include "jobs/checks.hpp"

namespace risley::jobs {
namespace {

/// Sigma of an index from a minute of any recording: docs/theory/flight.md
constexpr double kToldIndex = 1e-5;

std::vector<cloud::StripLine> lines_of(const calibration::PlannedFlight& planned) {
  std::vector<cloud::StripLine> lines;
  for (const trajectories::Strip& strip : planned.plan.strips) {
    const double x = 0.5 * strip.length * std::sin(strip.heading),
                 y = 0.5 * strip.length * std::cos(strip.heading);
    lines.push_back({strip.name,
                     {strip.center[0] - x, strip.center[1] - y},
                     {strip.center[0] + x, strip.center[1] + y},
                     strip.height - planned.mount.lever_arm[2].value});
  }
  return lines;
}

cloud::PointDistributionSummary distribution_of(const calibration::PlannedFlight& planned,
                                                const PlanFlightOptions& options,
                                                const Progress& progress) {
  cloud::PointDistribution distribution(
      lines_of(planned), cloud::swath_reach(planned.sensor, planned.mount), options.distribution);
  std::vector<std::uint16_t> strip;
  calibration::for_each_planned_piece(
      planned, calibration::flown(planned), {std::nullopt, options.seed},
      [&](calibration::PlannedPiece& piece) {
        strip = piece.shots.strip;
        for (std::uint16_t& number : strip) ++number;
        distribution.add(piece.x, piece.y, piece.z, strip, progress.silent());
      },
      progress);
  return distribution.summary();
}

}  // namespace

bool is_flight_plan(const std::string& path) {
  std::istringstream lines(io::read_text_file(path));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("strips:") || line.starts_with("risley_flight:")) return true;
  }
  return false;
}

void load_flight_plan(const FlightPlanFiles& files, PlanFlightOptions& options) {
  options.plan = trajectories::load_flight_plan(files.plan);
  if (files.mount.empty()) {
    throw InvalidArgument(
        fmt::format("{} is missing: a file that describes how the sensor is mounted on the "
                    "platform and, with its sigmas, how well that is known before the flight",
                    name_of(kSetting.mount)));
  }
  if (files.errors.empty()) {
    throw InvalidArgument(
        fmt::format("{} is missing: a file that states the expected size and duration of the "
                    "trajectory's errors",
                    name_of(kSetting.trajectory_errors)));
  }
  options.mount = mount_of(files.mount);
  options.errors = trajectories::load_error_model(files.errors);
  if (files.scene.empty()) return;
  const scenes::Scene scene = scenes::load_scene(files.scene);
  if (!scene.terrain) {
    throw InvalidArgument(fmt::format(
        "{} has no terrain to fly over: add terrain: {{ground: ...}} to it", files.scene));
  }
  options.terrain = scene.terrain->parts();
}

PlannedFlightResult plan_flight(const PlanFlightOptions& options, const Progress& progress) {
  if (options.rate) require_positive(kSetting.rate, *options.rate);
  if (options.range_noise) require_positive(kSetting.noise_range, *options.range_noise);
  if (options.prior_sigma) require_positive(kSetting.prior_sigma, *options.prior_sigma);
  require_not_negative(kSetting.range_offset_sigma, options.range_offset_sigma);
  require_positive(kSetting.knot_spacing, options.knot_spacing);
  require_positive(kSetting.cell_size, options.cell_size);
  for (const trajectories::ErrorTerm& term : options.errors.terms) {
    if (!term.sigma) {
      throw InvalidArgument(
          "the trajectory errors lack a sigma for one of the six components, and a planned flight "
          "has no accuracies that could replace it");
    }
  }
  PlannedFlightResult result;
  result.sensor = load_result(options.sensor.empty() ? GivenSensor(kUsualSensor) : options.sensor);
  calibration::FlightForecastOptions wanted;
  if (options.rate) wanted.rate = *options.rate;
  calibration::FlightCalibrationOptions& own = wanted.calibration;
  own.sensor = result.sensor;
  own.fixed = hold(options.fixed, own.sensor);
  own.additional = options.additional;
  own.mount = options.mount;
  own.errors = options.errors;
  own.range_noise = options.range_noise;
  own.range_offset_sigma = options.range_offset_sigma;
  if (options.prior_sigma) own.angle_sigma = *options.prior_sigma;
  own.knot_spacing = options.knot_spacing;
  own.cell_size = options.cell_size;
  own.seed = options.seed;
  // A recording determines the indices by itself, before strips are compared.
  for (const sensors::Knowledge& known : std::vector(own.sensor.knowledge)) {
    if (!known.name.starts_with("refractive_index") || known.name == "refractive_index_air" ||
        known.sigma <= kToldIndex) {
      continue;
    }
    own.sensor.set_knowledge({known.name, kToldIndex, "determined by a recording", 0});
  }
  calibration::PlannedFlight planned{own.sensor, options.mount, options.plan, {}};
  if (options.terrain) {
    planned.terrain = *options.terrain;
  } else {
    planned.terrain.ground = scenes::Ground{};
    warn(result.warnings, kWarning.terrain_assumed,
         "no terrain is given: the ground is assumed level at a height of 0, which reveals least; "
         "roofs reveal more");
  }
  const bool all_held =
      std::all_of(options.mount.boresight.begin(), options.mount.boresight.end(),
                  [](const trajectories::StatedValue& angle) { return angle.sigma == 0; });
  if (all_held) {
    warn(result.warnings, kWarning.taken_as_exact,
         "the mount gives its boresight a sigma of 0, so it counts as known and is not estimated: "
         "for a mount as built, state a sigma of 3 degrees");
  }
  result.forecast = calibration::forecast(planned, wanted, progress.stage("calibration"));
  try {
    result.distribution = distribution_of(planned, options, progress.stage("points"));
  } catch (const InvalidArgument& error) {
    warn(result.warnings, kWarning.distribution_unknown,
         "how densely points cover the ground is not reported: {}", error.what());
  }
  return result;
}

}  // namespace risley::jobs
