// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/calibration_plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "risley/calibration/calibrate.hpp"
#include "risley/calibration/planar_adjustment.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"
#include "risley/estimation/frame_turn.hpp"
#include "risley/optics/batch.hpp"
#include "risley/sensors/range_errors.hpp"

#include "calibration/range_terms.hpp"
#include "calibration/shot_labels.hpp"
#include "calibration/wall_matching.hpp"

namespace risley::calibration {
namespace {

/// A second pose is recommended if it reduces sigmas by this factor.
constexpr double kWorthRolling = 0.8;
/// Number of sampled shots that represent every recording: their own share of a wall is then known
/// to 0.4 %, sqrt(0.25 / 20000).
constexpr std::size_t kSampleShots = 20000;
/// Steeper walls determine the common direction 20 times as well as one met face on: table in
/// docs/theory/calibration.md, section Datum.
constexpr double kUsefulIncidence = radians_from_degrees(30.0);

/// Rotation angles of a sample of one recording: spread over its whole time, from start angles
/// without a rational relation to the next recording's.
std::vector<std::vector<double>> sample_angles(const CalibrationPlan& plan, std::size_t recording) {
  std::vector<std::vector<double>> angles;
  for (std::size_t k = 0; k < plan.sensor.angular_velocity.size(); ++k) {
    std::vector<double> column(kSampleShots);
    const double start = 1.0 + static_cast<double>(recording) * (2.0 + static_cast<double>(k));
    for (std::size_t i = 0; i < kSampleShots; ++i) {
      const double time =
          plan.duration * (static_cast<double>(i) + 0.5) / static_cast<double>(kSampleShots);
      column[i] = wrap_to_pi(rotation_angle_at(start, plan.sensor.angular_velocity[k], time));
    }
    angles.push_back(std::move(column));
  }
  return angles;
}

/// View of a planned recording: the shots of each plane of the scene.
struct Seen {
  std::vector<std::vector<std::size_t>> rows;  ///< [planes]
  std::vector<double> incidence, range;        ///< [planes], sums
};

std::vector<std::string> advice_for(const CalibrationForecast& f, const CalibrationPlan& plan) {
  std::vector<std::string> advice;
  double steep = 0, all = 0, far = 0;
  for (const PlannedWall& wall : f.walls) {
    all += wall.share;
    far += wall.share * wall.mean_range;
    if (wall.mean_incidence > kUsefulIncidence) steep += wall.share;
  }
  if (all > 0) far /= all;
  const auto recordings = static_cast<double>(std::max<std::size_t>(1, plan.scene.stations.size()));
  if (all < 0.9 * recordings) {
    advice.push_back(fmt::format(
        "only {:.0f} % of the shots meet a wall: walls that fill the field of view show more",
        100.0 * all / recordings));
  }
  if (f.rolled && f.rolled->total < kWorthRolling * f.datum.total) {
    advice.push_back(
        fmt::format("scan half of the time, roll the sensor by 180 degrees on the spot and scan "
                    "the same walls again ({}): their shape then cancels, and directions are known "
                    "to {:.2g} instead of {:.2g} degrees",
                    name_of(kSetting.same_walls), degrees_from_radians(f.rolled->total),
                    degrees_from_radians(f.datum.total)));
  }
  if (std::hypot(f.datum.sigma_pitch, f.datum.sigma_yaw) > kPoorDatum) {
    if (steep < 0.5 * all) {
      advice.push_back(
          "turn the sensor so that the beam meets the walls at 50 to 65 degrees of incidence: "
          "between 10 and 60 degrees, the sigma of the common direction falls by a factor of ten");
    }
    if (far < 20.0) {
      advice.push_back(
          fmt::format("the walls are {:.0f} m away: walls farther away give a smaller sigma", far));
    }
    if (f.datum_kind == DatumKind::none || f.datum_kind == DatumKind::planes) {
      advice.push_back(
          "scan the same walls also with the body turned upside down (180 degrees about its axis) "
          "and with it rotated by 30 degrees to both sides against a stop (stations with a "
          "sigma_deg): only that makes the common direction independent of the walls' flatness");
    }
    advice.push_back("record longer: the sigma falls with the square root of the duration");
  }
  return advice;
}

}  // namespace

std::vector<estimation::FreeParameter> calibration_parameters(
    TrainShape shape, const std::vector<std::string>& fixed,
    const std::vector<std::string>& additional) {
  std::vector<estimation::FreeParameter> usual =
      estimation::free_parameters(estimation::default_free_names(shape), shape);
  // Walls of unknown pose turn with the sensor as a lean of its last axis would turn it.
  estimation::hold_last_bearing(shape.prisms, usual);
  std::vector<std::string> names;
  for (const estimation::FreeParameter& parameter : usual) {
    if (parameter.name != "refractive_index") names.push_back(parameter.name);
  }
  for (const std::string& name : fixed) {
    if (find_parameter(name, shape).kind != ParameterKind::train) {
      throw InvalidArgument(
          fmt::format("{} cannot be held, only parameters of the prisms can", name));
    }
    if (std::ranges::find(additional, name) != additional.end()) {
      throw InvalidArgument(fmt::format("{} can be held or freed, not both", name));
    }
    std::erase(names, name);
  }
  for (const std::string& name : additional) {
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return estimation::free_parameters(names, shape);
}

AdjustedParameters adjusted_parameters(const sensors::Sensor& sensor,
                                       const std::vector<std::string>& fixed,
                                       const std::vector<std::string>& additional,
                                       std::optional<double> angle_sigma) {
  const TrainShape shape = sensor.shape();
  AdjustedParameters adjusted{calibration_parameters(shape, fixed, additional), {}};
  adjusted.prior_sigma = prior_sigmas(adjusted.free, shape, angle_sigma);
  for (const auto& tilt : estimation::uncertain_held(sensor, adjusted.free)) {
    if (is_material(tilt.places.front(), shape.prisms) ||
        std::ranges::find(fixed, tilt.name) != fixed.end()) {
      continue;
    }
    adjusted.free.push_back(estimation::free_parameters({tilt.name}, shape).front());
    adjusted.prior_sigma.push_back(
        std::min(tilt.prior_sigma, angle_sigma.value_or(tilt.prior_sigma)));
  }
  return adjusted;
}

namespace {

/// Quality of the plan with the poses of its stations.
/// @param poses_found  the relative poses of the stations are not known beforehand
CalibrationForecast forecast_once(const CalibrationPlan& plan, bool poses_found,
                                  const Progress& progress) {
  const sensors::Sensor& sensor = plan.sensor;
  const double rate = plan.rate.value_or(sensor.shot_rate);
  const double noise = plan.range_noise.value_or(sensor.range_noise);
  require_above("duration", plan.duration, 0, "s");
  require_above("rate", rate, 0, "Hz");
  require_above("range noise", noise, 0, "m");
  if (plan.prior_sigma) require_above("prior sigma", *plan.prior_sigma, 0, "rad");
  require_not_below("sigma of the range offset", plan.range_offset_sigma, 0, "m");
  CalibrationForecast result;
  PlanarProblem problem;
  problem.train = problem.prior = sensor.train;
  if (plan.beam_origin) problem.geometry = sensor.geometry;
  AdjustedParameters adjusted =
      adjusted_parameters(sensor, plan.fixed, plan.additional, plan.prior_sigma);
  problem.free = std::move(adjusted.free);
  problem.prior_sigma = std::move(adjusted.prior_sigma);
  problem.range_offset_sigma = plan.range_offset_sigma;
  if (!plan.shape.parameters.empty()) problem.range_terms = range_terms_of(sensor, true);
  problem.divergence = {sensor.beam_divergence_horizontal, sensor.beam_divergence_vertical};
  if (plan.beam_origin) {
    problem.geometry = one_size_each(problem.geometry, sensor.prisms());
    problem.sizes = size_priors(sensor);
  }
  // One shot of the sample represents several: its variance is divided by their number.
  const double weight = plan.duration * rate / static_cast<double>(kSampleShots);
  const double variance =
      (noise * noise + sensor.range_resolution * sensor.range_resolution / 12.0) / weight;

  std::vector<scenes::Station> stations = plan.scene.stations;
  const bool with_stations = !stations.empty();
  if (!with_stations) stations.push_back({});
  std::vector<FoundPlane> found;
  std::vector<std::string> names;
  std::vector<std::vector<double>> bundle(sensor.prisms());
  std::vector<std::uint8_t> bundle_beam;
  for (std::size_t r = 0; r < stations.size(); ++r) {
    progress.report(static_cast<double>(r) / static_cast<double>(stations.size() + 1));
    const scenes::Station& station = stations[r];
    names.push_back(station.name.empty() ? "the sensor" : station.name);
    RangedShots all;
    all.resize(sensor.prisms(), kSampleShots);
    all.rotation_angle = sample_angles(plan, r);
    for (std::size_t i = 0; i < kSampleShots; ++i) {
      all.beam[i] =
          static_cast<std::uint8_t>(i % static_cast<std::size_t>(sensor.train.emitters()));
    }
    for (const std::size_t row : spread_rows(kSampleShots, 2000)) {
      for (std::size_t k = 0; k < bundle.size(); ++k) {
        bundle[k].push_back(all.rotation_angle[k][row]);
      }
      bundle_beam.push_back(all.beam[row]);
    }
    Seen seen;
    seen.rows.resize(plan.scene.planes.size());
    seen.incidence.resize(plan.scene.planes.size());
    seen.range.resize(plan.scene.planes.size());
    for (std::size_t i = 0; i < kSampleShots; ++i) {
      std::vector<double> angles;
      for (const auto& column : all.rotation_angle) angles.push_back(column[i]);
      const Ray ray = emergent_ray(problem.train, problem.geometry, angles, all.beam[i]);
      if (!ray.valid) continue;
      const auto hit =
          nearest_hit(plan.scene, station.position + station.scene_from_sensor(ray.origin),
                      station.scene_from_sensor(ray.direction));
      if (!hit || hit->range < sensor.range_minimum || hit->range > sensor.range_maximum) continue;
      if (hit->surface >= plan.scene.planes.size()) continue;  // terrain hides walls, no more
      all.range[i] = hit->range;
      seen.rows[hit->surface].push_back(i);
      seen.incidence[hit->surface] += std::acos(hit->cosine);
      seen.range[hit->surface] += hit->range;
    }
    for (std::size_t w = 0; w < seen.rows.size(); ++w) {
      const auto n = static_cast<double>(seen.rows[w].size());
      if (seen.rows[w].size() < kLeastViewShots) continue;
      const scenes::ScenePlane& plane = plan.scene.planes[w];
      result.walls.push_back({plane.name, names.back(), n / static_cast<double>(kSampleShots),
                              seen.incidence[w] / n, seen.range[w] / n});
      result.shots += n * weight;
      auto shots = std::make_shared<RangedShots>(rows_of(all, seen.rows[w]));
      // Intensities as of one matt material: walls of one colour do not determine the walk error.
      shots->intensity.assign(shots->size(), static_cast<std::uint8_t>(sensors::kWalkIntensity));
      // The plane in the sensor's frame: R^T n, and closer by the station's offset towards it.
      const Vector3<double>& n_scene = plane.plane.normal;
      const Vector3<double> axes[] = {station.scene_from_sensor({1, 0, 0}),
                                      station.scene_from_sensor({0, 1, 0}),
                                      station.scene_from_sensor({0, 0, 1})};
      Plane mine{{dot(axes[0], n_scene), dot(axes[1], n_scene), dot(axes[2], n_scene)},
                 plane.plane.distance - dot(n_scene, station.position)};
      if (mine.distance < 0) mine = {-mine.normal, -mine.distance};
      found.push_back({r, mine, seen.rows[w].size(), 0});
      problem.views.push_back({r, 0, mine.distance, variance, std::move(shots), 1.0});
    }
  }
  if (problem.views.empty()) throw EstimationError("no shot of the plan meets a wall");

  const bool known_normals = std::ranges::any_of(
      plan.scene.planes,
      [](const scenes::ScenePlane& plane) { return plane.normal_sigma.has_value(); });
  const bool tied = (plan.stations_known || poses_found) && with_stations;
  std::optional<scenes::Scene> planes;
  if (known_normals || tied) planes = plan.scene;
  WallMatching matching = match_walls(found, names, planes,
                                      tied ? plan.scene.stations : std::vector<scenes::Station>{});
  problem.walls = std::move(matching.walls);
  problem.stations = std::move(matching.stations);
  problem.stations_known = matching.stations_known;
  for (std::size_t i = 0; i < found.size(); ++i) {
    problem.views[i].wall = found[i].wall;
    problem.views[i].side = found[i].side;
  }
  if (poses_found) {
    for (std::size_t s = 0; s < problem.stations.size(); ++s) {
      problem.stations[s].sigma = s == 0 ? 0.0 : std::numeric_limits<double>::infinity();
    }
  }
  result.datum_kind = datum_kind(known_normals, tied && !poses_found && stations.size() > 1);
  problem.shape = plan.shape;
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    auto shots = std::make_shared<RangedShots>(*problem.views[v].shots);
    fill_range_terms(problem, v, *shots);
    problem.views[v].shots = std::move(shots);
  }
  if (!plan.shape.parameters.empty()) lay_grids(problem);
  std::erase_if(problem.views, [](const WallView& view) { return view.shots->size() == 0; });

  AdjustmentOptions options;
  options.most_iterations = 0;  // ranges are exact: the plan is its own solution
  const PlanarSolution solution = adjust(problem, options, progress.silent());
  progress.check();
  result.free = problem.free;
  result.covariance = solution.covariance;
  result.range_offset_sigma = solution.number_sigma("range_offset_m");
  result.unobservable = estimation::weak_directions(
      solution.information + prior_information(problem), problem.free, kWidestDirection);
  result.datum =
      BeamBundle(problem.train, problem.free, bundle, bundle_beam).formal_datum(result.covariance);
  return result;
}

}  // namespace

CalibrationForecast forecast(const CalibrationPlan& plan, const Progress& progress) {
  CalibrationForecast result = forecast_once(plan, false, progress);
  if (plan.scene.stations.size() < 2 && !plan.shape.parameters.empty()) {
    // The same time in two poses, the second one being the first rolled on the spot.
    CalibrationPlan rolled = plan;
    rolled.duration = 0.5 * plan.duration;
    if (rolled.scene.stations.empty()) rolled.scene.stations.emplace_back();
    rolled.scene.stations.front().name = "upright";
    rolled.scene.stations.push_back(rolled.scene.stations.front());
    rolled.scene.stations.back().name = "rolled";
    rolled.scene.stations.back().roll += kPi;
    result.rolled = forecast_once(rolled, true, progress.silent()).datum;
  }
  result.advice = advice_for(result, plan);
  progress.report(1.0);
  return result;
}

}  // namespace risley::calibration
