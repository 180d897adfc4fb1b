// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Tables 1 and 2 and Fig. 2 of the paper: what the sensor is, and its scan pattern.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/report/chart.hpp"

#include "reproduction/runs.hpp"

namespace risley::reproduction {
namespace {

constexpr double kDensityCell = 0.25;      // deg
constexpr std::size_t kMostPoints = 4000;  ///< of the drawn pattern

/// Cells of a square grid over azimuth and elevation.
using Cell = std::pair<int, int>;

struct Pattern {
  std::vector<double> azimuth_deg, zenith_deg;  ///< of every shot
  std::vector<Cell> cell;
  std::vector<double> off_axis_deg;  ///< angle from the scan axis
};

/// The nominal sensor at constant speed, from the zero position, no noise.
Pattern scan(const ReproduceOptions& options, double duration) {
  simulation::SimulationSettings settings;
  settings.truth = options.type;
  settings.duration = duration;
  settings.angle_noise = 0.0;
  settings.quantize = false;
  settings.start_angles = {0.0, 0.0};
  const SimulatedRun run = simulate(settings);
  Pattern pattern;
  for (std::size_t i = 0; i < run.series.size(); ++i) {
    const double azimuth = degrees_from_radians(run.series.azimuth[i]);
    const double zenith = degrees_from_radians(run.series.zenith[i]);
    pattern.azimuth_deg.push_back(azimuth);
    pattern.zenith_deg.push_back(zenith);
    pattern.cell.emplace_back(static_cast<int>(std::floor(azimuth / kDensityCell)),
                              static_cast<int>(std::floor((zenith - 90.0) / kDensityCell)));
    const auto direction =
        direction_from_angles<double>({run.series.azimuth[i], run.series.zenith[i]});
    pattern.off_axis_deg.push_back(
        degrees_from_radians(angle_between(direction, Vector3<double>{1, 0, 0})));
  }
  return pattern;
}

/// Shots per square degree between two angles from the axis.
double density(const Pattern& pattern, double from_deg, double to_deg) {
  const auto inside =
      std::count_if(pattern.off_axis_deg.begin(), pattern.off_axis_deg.end(),
                    [&](double angle) { return angle >= from_deg && angle < to_deg; });
  return static_cast<double>(inside) / (kPi * (to_deg * to_deg - from_deg * from_deg));
}

std::set<Cell> cells(const Pattern& pattern, std::size_t from, std::size_t to) {
  const auto at = [&](std::size_t i) {
    return pattern.cell.begin() + static_cast<std::ptrdiff_t>(std::min(i, pattern.cell.size()));
  };
  return {at(from), at(to)};
}

}  // namespace

Reproduction scan_pattern(const ReproduceOptions& options) {
  Table table{"figure_2",
              "Fig. 2: scan pattern and density of observations",
              "The nominal sensor at constant speeds for 0.5 s, 100,000 shots a second.",
              {}};
  const Pattern pattern = scan(options, 0.5);
  const auto early = static_cast<std::size_t>(0.09 * options.type.shot_rate);

  constexpr double kRing = 1.0;  // deg
  const double centre = density(pattern, 0.0, kRing);
  double largest_elsewhere = 0;
  report::Series profile{"density", "a", report::SeriesKind::steps, {}, {}};
  for (double from = 0.0; from < 19.0; from += kRing) {
    const double ring = density(pattern, from, from + kRing);
    if (from > 0) largest_elsewhere = std::max(largest_elsewhere, ring);
    profile.x.push_back(from + 0.5 * kRing);
    profile.y.push_back(ring);
  }
  Row peak{"density within 1 degree of the axis over the largest of any other degree",
           "1",
           {},
           centre / largest_elsewhere};
  peak.checks = {at_least("ours", peak.ours, 1.0, "the paper: a peak at the centre")};
  table.rows.push_back(peak);
  Row edge{"density at the centre over that between 15 and 18 degrees from it",
           "1",
           {},
           centre / density(pattern, 15.0, 18.0)};
  edge.checks = {at_least("ours", edge.ours, 2.0, "the paper: nonhomogeneous, as in the retina")};
  table.rows.push_back(edge);

  const double all_cells = kPi * 19.2 * 19.2 / (kDensityCell * kDensityCell);
  const auto share = [&](std::size_t shots) {
    return static_cast<double>(cells(pattern, 0, shots).size()) / all_cells;
  };
  const double share_early = share(early), share_late = share(pattern.cell.size());
  Row covered{
      "share of the field of view met after 0.09 s, cells of 0.25 degree", "1", {}, share_early};
  covered.checks = {within("ours", covered.ours, 0.05, 0.95, "a rosette, not yet full (Fig. 2a)")};
  table.rows.push_back(covered);
  Row later{"the same after 0.5 s", "1", {}, share_late};
  later.checks = {at_least("ours less the share after 0.09 s", share_late - share_early, 0.1,
                           "the paper: density increases with time"),
                  at_most("ours", share_late, 1.05, "the field of view is 38.4 degrees across")};
  table.rows.push_back(later);
  const std::set<Cell> first = cells(pattern, 0, early), second = cells(pattern, early, 2 * early);
  const auto again = std::count_if(second.begin(), second.end(),
                                   [&](const Cell& cell) { return first.count(cell) == 0; });
  Row fresh{"share of new cells among those met from 0.09 to 0.18 s",
            "1",
            {},
            static_cast<double>(again) / static_cast<double>(second.size())};
  fresh.checks = {at_least("ours", fresh.ours, 0.2,
                           "the paper: not repetitively along a single projected path; a pattern "
                           "that repeats has none")};
  table.rows.push_back(fresh);

  report::Series shots{"shots", "a", report::SeriesKind::points, {}, {}};
  for (const std::size_t i : report::every_nth(early, kMostPoints)) {
    shots.x.push_back(pattern.azimuth_deg[i]);
    shots.y.push_back(pattern.zenith_deg[i]);
  }
  report::Chart rosette = field_of_view_chart("(a) scan pattern after 0.09 s", shots);
  rosette.note = report::every_nth_note(early, kMostPoints);
  constexpr double kMapCell = 0.5;  // deg
  std::map<Cell, double> count;
  for (std::size_t i = 0; i < pattern.cell.size(); ++i) {
    count[{static_cast<int>(std::floor(pattern.azimuth_deg[i] / kMapCell)),
           static_cast<int>(std::floor(pattern.zenith_deg[i] / kMapCell))}] += 1.0;
  }
  report::Series densities{"shots per square degree", "a", report::SeriesKind::cells, {}, {}};
  densities.cell_width = densities.cell_height = kMapCell;
  for (const auto& [cell, met] : count) {
    densities.x.push_back((cell.first + 0.5) * kMapCell);
    densities.y.push_back((cell.second + 0.5) * kMapCell);
    densities.value.push_back(met / (kMapCell * kMapCell));
  }
  const report::Chart map =
      field_of_view_chart("(b) shots per square degree after 0.5 s", densities);
  const report::Chart rings{"Density over the angle from the scan axis after 0.5 s",
                            "angle from the scan axis, deg",
                            densities.label,
                            {profile},
                            ""};
  return {{table}, {{"figure_2", "figure_2", table.title, {rosette, map, rings}}}};
}

Reproduction specifications(const ReproduceOptions& options) {
  Table one{
      "table_1",
      "Table 1: the manufacturer's specifications, as a simulated sensor has them",
      "One second of the simulated type at its full rate before a wall 20 m away on the axis.",
      {}};
  simulation::SimulationSettings settings;
  settings.truth = options.type;
  settings.range_noise = options.range_noise;
  settings.scene = scenes::parse_scene(
      "planes:\n  - {name: wall, distance_m: 20, normal_azimuth_deg: 0, normal_zenith_deg: 90}\n",
      "a wall at 20 m");
  settings.seed = run_seed(options, 900000);
  const SimulatedRun run = simulate(settings, true);
  double off_axis = 0, angle_error = 0;
  std::vector<double> range_error;
  for (std::size_t i = 0; i < run.series.size(); ++i) {
    const auto reported =
        direction_from_angles<double>({run.series.azimuth[i], run.series.zenith[i]});
    const auto truth = direction_from_angles<double>({run.truth.azimuth[i], run.truth.zenith[i]});
    off_axis = std::max(off_axis, angle_between(truth, Vector3<double>{1, 0, 0}));
    angle_error += std::pow(angle_between(reported, truth), 2);
    range_error.push_back(1e3 * (run.series.range[i] - run.truth.range[i]));
  }
  const auto digits = [&](const char* term, const char* unit, const char* paper, double ours) {
    Row row{term, unit, printed(paper), ours};
    row.checks = {at_printed_digits(*row.paper, ours)};
    one.rows.push_back(row);
  };
  digits("field of view, widest beam of the second", "deg", "38.4",
         2.0 * degrees_from_radians(off_axis));
  digits("point rate", "1/s", "100,000", static_cast<double>(run.series.size()));
  digits("range precision, 1 sigma at 20 m", "mm", "20", standard_deviation(range_error));
  Row accuracy{
      "angular accuracy", "deg", printed("0.1"),
      degrees_from_radians(std::sqrt(angle_error / static_cast<double>(run.series.size())))};
  accuracy.checks = {at_most("ours", accuracy.ours, 0.1, "the manufacturer: below 0.1")};
  one.rows.push_back(accuracy);

  Table two{"table_2",
            "Table 2: the parameters of the practical model",
            "The library's list of parameters, those of both prisms together.",
            {}};
  constexpr std::array kNames{"refractive_index_air",
                              "wedge_angle_deg",
                              "refractive_index",
                              "angular_velocity_a_deg_per_s",
                              "angular_velocity_b_deg_per_s",
                              "incident_beam_horizontal_deg",
                              "incident_beam_vertical_deg",
                              "bearing_tilt_a_horizontal_deg",
                              "bearing_tilt_a_vertical_deg",
                              "prism_tilt_a_horizontal_deg",
                              "prism_tilt_a_vertical_deg",
                              "prism_tilt_b_horizontal_deg",
                              "prism_tilt_b_vertical_deg"};
  double known = 0;
  for (const ParameterInfo& info : parameter_list({2})) {
    known += std::find(kNames.begin(), kNames.end(), info.name) != kNames.end();
  }
  Row count{"parameters of the model that the library knows by name", "1", printed("13"), known};
  count.checks = {at_printed_digits(*count.paper, known)};
  two.rows.push_back(count);
  return {{one, two}, {}};
}

}  // namespace risley::reproduction
