// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Section 3.3 of the paper: an incorrectly calibrated unit before a plane. Fig. 12.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/calibration/calibrate.hpp"
#include "risley/core/direction.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/parallel/parallel.hpp"

#include "reproduction/runs.hpp"

namespace risley::reproduction {
namespace {

using calibration::CalibrationMethod;
using calibration::DirectionErrors;

/// A plane 30 m away whose normal stands 10 degrees beside and 10 above the axis.
constexpr const char* kWall =
    "planes:\n"
    "  - {name: wall, distance_m: 30, normal_azimuth_deg: 10, normal_zenith_deg: 80}\n";
constexpr double kPapersRate = 1000.0, kFullRate = 100000.0;
constexpr std::size_t kMostBeams = 50000;  ///< to judge a calibration by

struct WallRun {
  SimulatedRun run;
  calibration::RangedRecording recording;
  std::vector<std::size_t> truth_row;  ///< [shots of the recording]
};

/// Section 3.3's recording with estimated rotation angles.
/// @param origin  whether beams start where they leave the last prism; the paper's start at the
///                frame's origin
WallRun record_wall(const ReproduceOptions& options, std::size_t draw, double rate, bool origin) {
  simulation::SimulationSettings settings = unit_settings(options, draw);
  settings.duration = 10.0;
  settings.rate = rate;
  if (!origin) settings.truth.set_prism_geometry({});
  settings.reported = settings.truth;
  settings.reported->train = settings.reported->train.without_errors();
  settings.scene = scenes::parse_scene(kWall, "section 3.3");
  WallRun wall;
  wall.run = simulate(settings, true);
  const estimation::Estimate estimate =
      estimate_run(estimation::Method::map, wall.run, options.type, options.angle_noise);
  wall.recording =
      calibration::ranged_recording(estimate, fmt::format("draw {}", draw), wall.run.serial);
  for (const std::int64_t time : wall.recording.time_ns) {
    const auto& times = wall.run.truth.time_ns;
    wall.truth_row.push_back(static_cast<std::size_t>(
        std::lower_bound(times.begin(), times.end(), time) - times.begin()));
  }
  return wall;
}

/// Root mean square errors of the reported azimuth and zenith, deg.
std::array<double, 2> reported_errors(const SimulatedRun& run) {
  std::array<double, 2> squares{};
  for (std::size_t i = 0; i < run.series.size(); ++i) {
    squares[0] += std::pow(run.series.azimuth[i] - run.truth.azimuth[i], 2);
    squares[1] += std::pow(run.series.zenith[i] - run.truth.zenith[i], 2);
  }
  const auto count = static_cast<double>(run.series.size());
  return {degrees_from_radians(std::sqrt(squares[0] / count)),
          degrees_from_radians(std::sqrt(squares[1] / count))};
}

/// Azimuth and zenith errors of single shots, rad: what Fig. 12 shows.
struct ShotErrors {
  std::vector<double> azimuth, zenith;
};

struct Judged {
  DirectionErrors errors;
  bool converged = false;
  double formal_total = 0;  ///< rad
  ShotErrors shots;
};

Judged judge(const WallRun& wall, const ReproduceOptions& options, CalibrationMethod method,
             bool origin, bool keep_shots) {
  calibration::CalibrationOptions settings;
  settings.method = method;
  settings.sensor = options.type;
  settings.range_noise = options.range_noise;
  settings.beam_origin = origin;
  settings.shape = {};  // the wall is an exact plane, as in the paper
  const calibration::Calibration found = calibration::calibrate({wall.recording}, settings);
  Judged judged;
  judged.converged = found.converged;
  judged.formal_total = found.datum.total;
  std::vector<Vector3<double>> after, truth;
  std::vector<double> angles(2);
  for (const std::size_t shot : calibration::spread_rows(wall.truth_row.size(), kMostBeams)) {
    for (std::size_t k = 0; k < angles.size(); ++k) {
      angles[k] = wall.recording.shots.rotation_angle[k][shot] + found.angle_shift[0][k];
    }
    const std::size_t row = wall.truth_row[shot];
    const SphericalAngles<double> true_angles{wall.run.truth.azimuth[row],
                                              wall.run.truth.zenith[row]};
    after.push_back(observe(found.sensor.train, angles).direction);
    truth.push_back(direction_from_angles(true_angles));
    if (keep_shots) {
      const auto adjusted = angles_from_direction(after.back());
      judged.shots.azimuth.push_back(adjusted.azimuth - true_angles.azimuth);
      judged.shots.zenith.push_back(adjusted.zenith - true_angles.zenith);
    }
  }
  judged.errors = calibration::direction_errors(after, truth);
  return judged;
}

/// One draw of the paper's own case.
struct CalibrationDraw {
  std::array<double, 2> before{};  ///< deg
  Judged paper, weighted;
  ShotErrors reported;  ///< of the first draw
};

Row distribution_row(std::string term, const char* paper, const std::vector<double>& values) {
  Row row{std::move(term), "deg", printed(paper)};
  row.distribution = distribution_of(values, row.paper->value);
  row.ours = row.distribution->median;
  row.checks = {within("percentile of the paper's draw among ours", row.distribution->percentile,
                       2.5, 97.5, "the central 95 % of our draws")};
  row.note = fmt::format("Ours from {} draws, 5, 50 and 95 %: {:.3f}, {:.3f}, {:.3f}.",
                         row.distribution->draws, row.distribution->low, row.distribution->median,
                         row.distribution->high);
  return row;
}

std::vector<double> column(const std::vector<CalibrationDraw>& draws,
                           const Judged CalibrationDraw::*who, double DirectionErrors::*what) {
  std::vector<double> values;
  values.reserve(draws.size());
  for (const CalibrationDraw& draw : draws)
    values.push_back(degrees_from_radians((draw.*who).errors.*what));
  return values;
}

double share_converged(const std::vector<CalibrationDraw>& draws,
                       const Judged CalibrationDraw::*who) {
  double sum = 0;
  for (const CalibrationDraw& draw : draws) sum += (draw.*who).converged;
  return sum;
}

/// Mean of a bias: zero within what its scatter allows.
Row mean_bias(const char* axis, const std::vector<double>& bias) {
  const double count = static_cast<double>(bias.size());
  const double limit = 3.3 * standard_deviation(bias) / std::sqrt(count);
  Row row{fmt::format("mean over all draws of the {} bias after the adjustment", axis),
          "deg",
          {},
          mean_of(bias)};
  row.sigma = standard_deviation(bias) / std::sqrt(count);
  row.checks = {within("ours", row.ours, -limit, limit,
                       "99.9 % of the mean of so many unbiased draws: the paper's bias is the "
                       "scatter that 20 mm leave, not a systematic error")};
  return row;
}

constexpr double kPapersAzimuth = 0.066, kPapersZenith = 0.022;

Table papers_rows(const std::vector<CalibrationDraw>& draws) {
  Table table{"section_3_3",
              "Section 3.3: an incorrectly calibrated unit before a plane",
              fmt::format("The paper's case: 10 s at 1 kHz, a plane 30 m away turned by 10 and 10 "
                          "degrees, 0.01 degree and 20 mm noise, a unit that believes all its "
                          "errors to be zero. The paper's adjusted numbers are one random draw; "
                          "here are {} draws of the same adjustment and where the paper's falls.",
                          draws.size()),
              {}};
  const auto initial = [&](const char* term, const char* paper, std::size_t axis) {
    std::vector<double> values;
    values.reserve(draws.size());
    for (const CalibrationDraw& draw : draws) values.push_back(draw.before[axis]);
    Row row{term, "deg", printed(paper), mean_of(values)};
    row.checks = {at_printed_digits(*row.paper, row.ours)};
    table.rows.push_back(row);
  };
  initial("RMSE of the reported azimuth", "0.077", 0);
  initial("RMSE of the reported zenith", "0.396", 1);
  const auto azimuth_bias = column(draws, &CalibrationDraw::paper, &DirectionErrors::azimuth_bias);
  const auto zenith_bias = column(draws, &CalibrationDraw::paper, &DirectionErrors::zenith_bias);
  table.rows.push_back(
      distribution_row("RMSE of the adjusted azimuth", "0.066",
                       column(draws, &CalibrationDraw::paper, &DirectionErrors::azimuth_rmse)));
  table.rows.push_back(
      distribution_row("RMSE of the adjusted zenith", "0.022",
                       column(draws, &CalibrationDraw::paper, &DirectionErrors::zenith_rmse)));
  table.rows.push_back(distribution_row("bias of the adjusted azimuth", "-0.065", azimuth_bias));
  table.rows.push_back(distribution_row("bias of the adjusted zenith", "-0.021", zenith_bias));
  table.rows.push_back(mean_bias("azimuth", azimuth_bias));
  table.rows.push_back(mean_bias("zenith", zenith_bias));
  return table;
}

void add_ours(Table& table, const std::vector<CalibrationDraw>& draws) {
  const double papers_total = std::hypot(kPapersAzimuth, kPapersZenith);
  const auto count = static_cast<double>(draws.size());
  Row shape{"paper's adjustment: error that is not a rotation of all beams, mean",
            "deg",
            {},
            mean_of(column(draws, &CalibrationDraw::paper, &DirectionErrors::shape))};
  shape.checks = {at_most("ours", shape.ours, 0.0228,
                          "what it was before, 0.0228: the bundle's shape is calibrated, what "
                          "stays is the direction that all beams share")};
  table.rows.push_back(shape);
  double squares = 0, formal = 0;
  for (const CalibrationDraw& draw : draws) {
    squares += std::pow(draw.weighted.errors.total, 2);
    formal += std::pow(draw.weighted.formal_total, 2);
  }
  Row weighted{"our adjustment at 1 kHz: total error, median", "deg", {}, 0};
  weighted.distribution = distribution_of(
      column(draws, &CalibrationDraw::weighted, &DirectionErrors::total), papers_total);
  weighted.ours = weighted.distribution->median;
  weighted.checks = {rms_ratio("root mean square of the total errors over the formal ones",
                               std::sqrt(squares / formal), 1.5 * count,
                               "errors are what the covariance says; a total error has but one or "
                               "two degrees of freedom that count")};
  weighted.note = fmt::format(
      "From {} draws, 5, 50 and 95 %: {:.3f}, {:.3f}, {:.3f}. No weight helps on this "
      "plane: 10,000 ranges of 20 mm contain no more information.",
      draws.size(), weighted.distribution->low, weighted.distribution->median,
      weighted.distribution->high);
  table.rows.push_back(weighted);
  Row converged{"adjustments that converged, both kinds",
                "1",
                {},
                share_converged(draws, &CalibrationDraw::paper) +
                    share_converged(draws, &CalibrationDraw::weighted)};
  converged.checks = {at_least("ours", converged.ours, 2.0 * count, "all of them")};
  table.rows.push_back(converged);
}

void add_full_rate(Table& table, const std::vector<Judged>& all) {
  const double papers_total = std::hypot(kPapersAzimuth, kPapersZenith);
  std::vector<double> total, azimuth, zenith;
  for (const Judged& one : all) {
    total.push_back(degrees_from_radians(one.errors.total));
    azimuth.push_back(degrees_from_radians(one.errors.azimuth_rmse));
    zenith.push_back(degrees_from_radians(one.errors.zenith_rmse));
  }
  const auto add = [&](const char* term, const char* paper, const std::vector<double>& values) {
    Row row{term, "deg", printed(paper), root_mean_square(values)};
    row.checks = {at_most("the largest of ours over the paper's",
                          *std::max_element(values.begin(), values.end()) / row.paper->value, 1.0,
                          "all shots beat the paper's draw in every draw")};
    table.rows.push_back(row);
  };
  add("our adjustment, all 100 kHz: RMSE of the azimuth", "0.066", azimuth);
  add("our adjustment, all 100 kHz: RMSE of the zenith", "0.022", zenith);
  Row row{"our adjustment, all 100 kHz: total error, mean", "deg", {}, mean_of(total)};
  row.checks = {at_most("the largest of ours over the paper's 0.0696",
                        *std::max_element(total.begin(), total.end()) / papers_total, 0.5,
                        "a hundred times the shots: ten times the accuracy, half in every draw")};
  row.note =
      fmt::format("{} draws of 10 s; beams start where they leave the last prism.", all.size());
  table.rows.push_back(row);
}

Figure figure_12(const std::vector<CalibrationDraw>& draws) {
  Figure figure{"figure_12",
                "section_3_3",
                "Fig. 12: errors of the directions before and after the adjustment (first draw)",
                {}};
  const CalibrationDraw& first = draws.front();
  figure.charts = {
      histogram_chart("(a) azimuth before", "deg", first.reported.azimuth, kDegreesPerRadian),
      histogram_chart("(b) zenith before", "deg", first.reported.zenith, kDegreesPerRadian),
      histogram_chart("(c) azimuth after", "deg", first.paper.shots.azimuth, kDegreesPerRadian),
      histogram_chart("(d) zenith after", "deg", first.paper.shots.zenith, kDegreesPerRadian)};
  const report::Series ours{"our draws", "a", report::SeriesKind::points,
                            column(draws, &CalibrationDraw::paper, &DirectionErrors::azimuth_bias),
                            column(draws, &CalibrationDraw::paper, &DirectionErrors::zenith_bias)};
  const report::Series papers{
      "the paper's draw", "b", report::SeriesKind::points, {-0.065}, {-0.021}};
  figure.charts.push_back({"Biases after the adjustment: all draws and the paper's",
                           "azimuth bias, deg",
                           "zenith bias, deg",
                           {ours, papers},
                           "",
                           report::ChartKind::map});
  return figure;
}

}  // namespace

Reproduction incorrect_calibration(const ReproduceOptions& options, const Progress& progress) {
  const Effort& effort = options.effort;
  std::vector<CalibrationDraw> draws(effort.wall_seeds);
  parallel::for_each_job(
      draws.size(),
      [&](std::size_t i) {
        const WallRun wall = record_wall(options, i, kPapersRate, false);
        CalibrationDraw& draw = draws[i];
        draw.before = reported_errors(wall.run);
        draw.paper = judge(wall, options, CalibrationMethod::paper, false, i == 0);
        draw.weighted = judge(wall, options, CalibrationMethod::adjustment, false, false);
        if (i > 0) return;
        for (std::size_t s = 0; s < wall.run.series.size(); ++s) {
          draw.reported.azimuth.push_back(wall.run.series.azimuth[s] - wall.run.truth.azimuth[s]);
          draw.reported.zenith.push_back(wall.run.series.zenith[s] - wall.run.truth.zenith[s]);
        }
      },
      progress.part(0.0, 0.6));
  std::vector<Judged> full(effort.wall_full_rate_seeds);
  parallel::for_each_job(
      full.size(),
      [&](std::size_t i) {
        const WallRun wall = record_wall(options, i, kFullRate, true);
        full[i] = judge(wall, options, CalibrationMethod::adjustment, true, false);
      },
      progress.part(0.6, 1.0));
  Table table = papers_rows(draws);
  add_ours(table, draws);
  if (!full.empty()) add_full_rate(table, full);
  return {{table}, {figure_12(draws)}};
}

}  // namespace risley::reproduction
