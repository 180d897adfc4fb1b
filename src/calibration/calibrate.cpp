// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "risley/calibration/calibration_plan.hpp"
#include "risley/calibration/paper_adjustment.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

#include "calibration/belief.hpp"
#include "calibration/calibrated_sensor.hpp"
#include "calibration/copies.hpp"
#include "calibration/entry_checks.hpp"
#include "calibration/held.hpp"
#include "calibration/labelled_shots.hpp"
#include "calibration/range_terms.hpp"
#include "calibration/same_walls.hpp"
#include "calibration/shot_blocks.hpp"
#include "calibration/verdict.hpp"
#include "calibration/wall_flatness.hpp"
#include "calibration/wall_matching.hpp"
#include "calibration/wall_search.hpp"
#include "calibration/wall_thickness.hpp"

namespace risley::calibration {
namespace {

/// Shots for finding the planes, of all recordings together and of each at least, and rounds of
/// labels and adjustment on these and on all shots: docs/theory/calibration.md
constexpr std::size_t kCoarseShots = 40000, kLeastCoarseShots = 5000;
constexpr int kCoarseRounds = 5, kMostFullRounds = 5;
/// Number of beams of all recordings that formal sigmas are averaged over: beams are smooth in two
/// rotation angles, which so many sample every 6 degrees, 360 / sqrt(4000).
constexpr std::size_t kBundleBeams = 4000;
/// Variance of a normal distribution cut off at the gate g: 1 - 2 g phi(g) / (2 Phi(g) - 1).
constexpr double kVarianceWithinGate = 0.97334;
/// Keeps the variance of ranges without noise above 0; sensors have steps of 1 mm. M.
constexpr double kLeastRangeSigma = 1e-7;
/// Steps have converged when the number of excluded shots changes by less than one in a hundred.
constexpr std::size_t kSettledPart = 100;

/// Variance component of every view: the range noise according to its residuals.
void update_range_variances(PlanarSolution& solution) {
  for (std::size_t v = 0; v < solution.chi2.size(); ++v) {
    if (solution.redundancy[v] < kLeastViewShots) continue;
    const double factor = solution.chi2[v] / solution.redundancy[v] / kVarianceWithinGate;
    double& variance = solution.problem.views[v].range_variance;
    variance = std::max(variance * factor, kLeastRangeSigma * kLeastRangeSigma);
  }
}

/// Columns and matrices of one recording that belong together.
void require_recording(const RangedRecording& recording) {
  require_at_least("number of shots", recording.shots.size(), 1);
  require_shots(recording.shots, recording.believed.train);
  const auto prisms = static_cast<std::size_t>(recording.believed.prisms());
  const auto matrix = [](const char* rows, const char* columns, const Eigen::MatrixXd& m,
                         std::size_t expected_rows, std::size_t expected_columns) {
    require_length(rows, m.rows(), expected_rows);
    require_length(columns, m.cols(), expected_columns);
  };
  const std::size_t free = recording.free.size();
  matrix("rows of the covariance", "columns of the covariance", recording.covariance, free, free);
  matrix("rows of angle_sensitivity", "columns of angle_sensitivity", recording.angle_sensitivity,
         prisms, free);
  matrix("rows of mean_angle_covariance", "columns of mean_angle_covariance",
         recording.mean_angle_covariance, prisms, prisms);
}

/// The shots with other rotation angles. @param shift  [prisms], rad
RangedShots shifted(const RangedShots& shots, const std::vector<double>& shift) {
  RangedShots result = columns_like(shots, shots.size());
  for_each_block(shots.size(), [&](std::size_t begin, std::size_t end) {
    const auto copy = [&](const auto& from, auto& to) {
      if (from.empty()) return;  // emitters that are not known
      std::copy(from.data() + begin, from.data() + end, to.data() + begin);
    };
    for_each_column<kRangedShotColumns>(copy, shots, result);
    for (std::size_t k = 0; k < shift.size(); ++k) {
      for (std::size_t i = begin; i < end; ++i) result.rotation_angle[k][i] += shift[k];
    }
  });
  return result;
}

/// One run, from recordings to results.
class WallCalibration {
 public:
  WallCalibration(const std::vector<RangedRecording>& recordings, const CalibrationOptions& options,
                  const Progress& progress)
      : recordings_(recordings), options_(options), progress_(progress) {
    range_noise_ = options.range_noise.value_or(options.sensor.range_noise);
    require_entries();
    belief_ = pooled_belief(recordings);
    require_no_copies(recordings);
    // Rounding adds its own variance.
    range_noise_ = std::hypot(range_noise_, options.sensor.range_resolution / std::sqrt(12.0));
    for (std::size_t r = 0; r < recordings.size(); ++r) {
      LabelledShots& own = all_.emplace_back();
      own.shots = shifted(recordings[r].shots, belief_.angle_shift[r]);
      own.pointing = pointing_of_angles(own.shots);
    }
  }

  Calibration run() {
    set_up();
    find_walls();
    progress_.report(0.3);
    adjust_coarsely();
    progress_.report(0.5);
    PlanarSolution solution = adjust_fully();
    progress_.report(0.9);
    fill_result(solution);
    progress_.report(1.0);
    return std::move(result_);
  }

 private:
  void require_entries() const {
    require_at_least("number of recordings", recordings_.size(), 1);
    require_length_or_none("stations", options_.stations.size(), recordings_.size());
    require_above("range noise", range_noise_, 0, "m");
    require_not_below("range resolution", options_.sensor.range_resolution, 0, "m");
    if (options_.prior_sigma) require_above("prior sigma", *options_.prior_sigma, 0, "rad");
    require_not_below("sigma of the range offset", options_.range_offset_sigma, 0, "m");
    require_not_below("patch thickness", options_.patch_thickness, 0, "m");
    if (options_.tolerance) require_not_below("tolerance", *options_.tolerance, 0, "rad");
    for (const auto& [name, value] : options_.fixed) {
      if (value) require_finite(name, *value);
    }
    for (const RangedRecording& recording : recordings_) require_recording(recording);
  }

  bool paper() const { return options_.method == CalibrationMethod::paper; }
  bool flat() const { return options_.shape.parameters.empty(); }

  void set_up() {
    PlanarProblem& p = problem_;
    p.train = belief_.sensor.train;
    if (options_.beam_origin) p.geometry = options_.sensor.geometry;
    std::vector<std::string> held;
    for (const auto& [name, value] : options_.fixed) held.push_back(name);
    if (paper()) {
      p.free = calibration_parameters(p.train.shape(), held, options_.additional);
      p.prior_sigma = prior_sigmas(p.free, p.train.shape(), options_.prior_sigma);
    } else {
      AdjustedParameters adjusted =
          adjusted_parameters(options_.sensor, held, options_.additional, options_.prior_sigma);
      p.free = std::move(adjusted.free);
      p.prior_sigma = std::move(adjusted.prior_sigma);
    }
    for (const auto& [name, value] : options_.fixed) {
      if (!value) continue;
      for (const int place : find_parameter(name, p.train.shape()).places) {
        p.train.set_place(place, *value);
      }
    }
    p.prior = p.train;
    p.range_offset_sigma = options_.range_offset_sigma;
    if (!paper() && !flat()) {
      const bool intensities = std::ranges::all_of(
          recordings_, [](const RangedRecording& one) { return !one.shots.intensity.empty(); });
      p.range_terms = range_terms_of(options_.sensor, intensities);
      p.divergence = {options_.sensor.beam_divergence_horizontal,
                      options_.sensor.beam_divergence_vertical};
    }
    if (!paper() && options_.beam_origin) {
      p.geometry = one_size_each(p.geometry, p.train.prisms());
      p.sizes = size_priors(options_.sensor);
    }
    p.considered = belief_.free;
    p.considered_covariance = belief_.covariance;
    for (const RangedRecording& recording : recordings_) {
      p.angle_sensitivity.push_back(recording.angle_sensitivity);
      p.mean_angle_covariance.push_back(recording.mean_angle_covariance);
    }
  }

  /// Planes in every recording separately, then which of them are the same wall.
  void find_walls() {
    const std::size_t most =
        std::max<std::size_t>(kCoarseShots / recordings_.size(), kLeastCoarseShots);
    std::vector<FoundPlane> found;
    std::vector<std::vector<int>> labels;
    for (std::size_t r = 0; r < recordings_.size(); ++r) {
      const RangedShots& shots = all_[r].shots;
      coarse_.push_back(rows_of(shots, spread_rows(shots.size(), most)));
      Segmentation segmentation = search_walls(coarse_[r], problem_.train, problem_.geometry,
                                               {range_noise_, all_[r].pointing}, options_.seed + r);
      for (std::size_t i = 0; i < segmentation.planes.size(); ++i) {
        found.push_back({r, segmentation.planes[i], segmentation.points[i], 0});
      }
      labels.push_back(std::move(segmentation.label));
      if (segmentation.planes.empty()) {
        const std::string why = fmt::format(
            "{}: no plane found among {} points{}", recordings_[r].name, coarse_[r].size(),
            segmentation.on_one_line
                ? ": its flat parts lie on one line, and a wall has to fill an area"
                : "");
        if (recordings_.size() == 1) throw EstimationError(why);
        warn(result_.warnings, kWarning.input_left_out, "{}; it is left out", why);
      }
    }
    if (found.empty()) throw EstimationError("no plane found in any recording");
    std::vector<std::string> names;
    for (const RangedRecording& recording : recordings_) names.push_back(recording.name);
    // The paper's method has no datum.
    const FoundPoses poses = found_poses(found, names);
    WallMatching matching =
        paper() ? match_walls(found, names, std::nullopt, {})
                : match_walls(found, names, options_.planes,
                              poses.stations.empty() ? options_.stations : poses.stations);
    problem_.walls = std::move(matching.walls);
    problem_.stations = std::move(matching.stations);
    result_.same_walls = !poses.stations.empty();
    if (result_.same_walls) problem_.stations[poses.reference].sigma = 0;
    problem_.stations_known = matching.stations_known;
    append(result_.warnings, matching.warnings);
    const bool planes = std::ranges::any_of(
        problem_.walls, [](const Wall& wall) { return wall.normal_sigma >= 0; });
    const bool stations =
        problem_.stations_known && !options_.stations.empty() && recordings_.size() > 1;
    result_.datum_kind = datum_kind(planes, stations);
    std::vector<std::size_t> first_view(recordings_.size(), 0);
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (i == 0 || found[i].recording != found[i - 1].recording) {
        first_view[found[i].recording] = i;
      }
      problem_.views.push_back({found[i].recording, found[i].wall, found[i].plane.distance,
                                range_noise_ * range_noise_, nullptr, found[i].side});
    }
    for (std::size_t r = 0; r < recordings_.size(); ++r) {
      for (int& label : labels[r]) {
        if (label >= 0) label += static_cast<int>(first_view[r]);
      }
      hand_out(coarse_[r], labels[r], r, problem_);
    }
  }

  /// Relative poses of recordings from unknown poses, if they saw the same walls.
  FoundPoses found_poses(const std::vector<FoundPlane>& found,
                         const std::vector<std::string>& names) const {
    const bool stated = options_.planes || !options_.stations.empty();
    if (options_.same_walls == SameWalls::no || paper() || stated || names.size() < 2) return {};
    FoundPoses poses = poses_before_same_walls(found, names);
    if (poses.stations.empty() && options_.same_walls == SameWalls::yes) {
      throw EstimationError("the recordings do not show the same walls: " + poses.why_not);
    }
    return poses;
  }

  PlanarSolution solve(const PlanarProblem& problem) {
    solved_variance_.clear();
    for (const WallView& view : problem.views) solved_variance_.push_back(view.range_variance);
    return paper() ? adjust_as_paper(problem) : adjust(problem);
  }

  /// Views that lost their shots when labels changed are removed, and so are walls without a view.
  void drop_empty_views(PlanarProblem& problem) const {
    std::erase_if(problem.views,
                  [](const WallView& view) { return view.shots->size() < kLeastViewShots; });
    if (problem.views.empty()) {
      throw EstimationError(
          "no plane is left after every shot was assigned to the plane it fits best");
    }
    std::vector<std::size_t> row(problem.walls.size(), 0);
    for (const WallView& view : problem.views) row[view.wall] = 1;
    std::vector<Wall> seen;
    for (std::size_t w = 0; w < row.size(); ++w) {
      const bool any = row[w] != 0;
      row[w] = seen.size();
      if (any) seen.push_back(problem.walls[w]);
    }
    problem.walls = std::move(seen);
    for (WallView& view : problem.views) view.wall = row[view.wall];
  }

  void adjust_coarsely() {
    drop_empty_views(problem_);
    for (int round = 0; round < kCoarseRounds; ++round) {
      PlanarSolution solution = solve(problem_);
      result_.iterations = std::max(result_.iterations, solution.iterations);
      if (!std::isfinite(solution.cost)) throw EstimationError("the adjustment diverged");
      update_range_variances(solution);
      problem_ = std::move(solution.problem);
      for (std::size_t r = 0; r < recordings_.size(); ++r) {
        hand_out(coarse_[r], label_shots(problem_, r, coarse_[r], all_[r].pointing).view, r,
                 problem_);
      }
      drop_empty_views(problem_);
    }
  }

  void label_all() {
    for (std::size_t r = 0; r < all_.size(); ++r) {
      all_[r].labels = label_shots(problem_, r, all_[r].shots, all_[r].pointing);
    }
  }

  void hand_out_all() {
    for (std::size_t r = 0; r < all_.size(); ++r) {
      hand_out(all_[r].shots, all_[r].labels.view, r, problem_);
    }
  }

  /// Labels all shots, except the steps, and assigns them to views. Views with too few shots are
  /// dropped, and their shots are assigned to others.
  void share_out(bool steps) {
    for (;;) {
      label_all();
      if (steps && !paper()) result_.steps = leave_out_steps(problem_, all_);
      hand_out_all();
      const std::size_t before = problem_.views.size();
      drop_empty_views(problem_);
      if (problem_.views.size() == before) return;
    }
  }

  PlanarSolution adjust_fully() {
    share_out(false);
    // The first solution bends towards steps and hides their rims: labels and solution alternate
    // until the excluded shots stay the same.
    PlanarSolution solution;
    std::size_t left_out = 0;
    bool settled = false;
    for (int round = 0; round < kMostFullRounds; ++round) {
      solution = solve(problem_);
      update_range_variances(solution);
      problem_ = solution.problem;
      progress_.report(0.5 + 0.08 * (round + 1));
      if (settled || round + 1 == kMostFullRounds) break;
      share_out(true);
      const std::size_t before = std::exchange(left_out, 0);
      for (const SurfaceStep& step : result_.steps) left_out += step.points;
      settled = std::max(before, left_out) - std::min(before, left_out) <= left_out / kSettledPart;
    }
    if (paper()) return solution;
    problem_.shape = options_.shape;
    for (int round = 0; round < 2 && !flat(); ++round) {
      lay_grids(problem_);
      solution = solve(problem_);
      update_range_variances(solution);
      problem_ = solution.problem;
    }
    // An error of a decade's share moves the term of the intensity by as much, and nothing else.
    if (const Eigen::Index row = solution.number("range_per_decade_m"); row >= 0) {
      solution.number_covariance(row, row) += options_.patch_thickness * options_.patch_thickness;
    }
    return solution;
  }

  void fill_result(const PlanarSolution& solution);
  void fill_held(const PlanarSolution& solution);
  void fill_numbers(const PlanarSolution& solution);
  void fill_datum(const PlanarSolution& solution);

  const std::vector<RangedRecording>& recordings_;
  const CalibrationOptions& options_;
  const Progress& progress_;
  Belief belief_;
  double range_noise_ = 0;
  std::vector<LabelledShots> all_;       // [recordings]
  std::vector<RangedShots> coarse_;      // [recordings], some of them
  std::vector<double> solved_variance_;  // [views] of the last solve, m^2
  PlanarProblem problem_;
  Held held_;
  Calibration result_;
};

void WallCalibration::fill_result(const PlanarSolution& solution) {
  const PlanarProblem& p = solution.problem;
  result_.method = options_.method;
  result_.believed = belief_.sensor.train;
  result_.angle_shift = belief_.angle_shift;
  result_.free = p.free;
  result_.parameters = solution.parameters;
  result_.covariance = solution.covariance;
  result_.prior_tests = solution.prior_tests;
  result_.unobservable = estimation::weak_directions(solution.information + prior_information(p),
                                                     p.free, kWidestDirection);
  double stated = 0, redundancy = 0;
  for (std::size_t v = 0; v < p.views.size(); ++v) {
    stated += solution.chi2[v] * solved_variance_[v];
    redundancy += solution.redundancy[v];
  }
  result_.sigma0 = std::sqrt(stated / redundancy / kVarianceWithinGate) / range_noise_;
  result_.shape = solution.shape.mean;
  fill_held(solution);
  fill_numbers(solution);
  WallThickness walls = wall_thickness(solution, belief_.sensor.train, all_);
  result_.planes = std::move(walls.planes);
  result_.profiles = std::move(walls.profiles);
  result_.rms_before = walls.rms_before;
  result_.rms_after = walls.rms_after;
  result_.points = walls.points;
  result_.sensor = calibrated_sensor(options_, belief_, solution, result_, held_);
  result_.sensor.serial = recordings_.front().serial;
  fill_datum(solution);
  result_.reason = reason_of_failure(result_, solution);
  if (result_.reason.empty()) {
    result_.reason = reason_of_ranges(result_, recordings_, range_noise_);
    result_.unit_doubted = !result_.reason.empty();
  }
  result_.converged = result_.reason.empty();
  result_.tolerance = options_.tolerance.value_or(options_.sensor.pointing_tolerance);
  result_.verdict = verdict_of(result_);
  append(result_.warnings, warnings_of(result_, solution, recordings_));
  for (LabelledShots& own : all_) result_.plane_of_shot.push_back(std::move(own.labels.view));
}

void WallCalibration::fill_held(const PlanarSolution& solution) {
  if (paper() || !solution.converged || !result_.covariance.allFinite()) return;
  held_ = held_of(options_.sensor, belief_, solution.problem);
  if (held_.names.empty()) return;
  SolutionResponse response = held_response(solution.problem, held_.quantities);
  result_.held = held_.names;
  result_.held_changes = std::move(response.parameters);
  result_.number_held_changes = std::move(response.numbers);
}

void WallCalibration::fill_numbers(const PlanarSolution& solution) {
  const PlanarProblem& p = solution.problem;
  const auto add = [&](const std::string& name, double prior, double prior_sigma) {
    const Eigen::Index row = solution.number(name);
    if (row < 0) return;
    CalibratedNumber number{name, solution.number_values[row], prior, prior_sigma};
    number.sigma = number.total_sigma = solution.number_sigma(name);
    if (result_.number_held_changes.cols() > 0) {
      number.total_sigma = std::hypot(number.sigma, result_.number_held_changes.row(row).norm());
    }
    result_.numbers.push_back(std::move(number));
  };
  for (const SizePrior& size : p.sizes) add(size.size.name, size.value, size.sigma);
  for (const RangeTerm& term : p.range_terms) add(term.name, term.prior, term.sigma);
  add("range_offset_m", 0.0, p.range_offset_sigma);
}

void WallCalibration::fill_datum(const PlanarSolution& solution) {
  const PlanarProblem& p = solution.problem;
  std::vector<std::vector<double>> beams(p.train.prisms());
  std::vector<std::uint8_t> emitter;
  for (std::size_t r = 0; r < recordings_.size(); ++r) {
    for (const std::size_t row :
         spread_rows(all_[r].shots.size(), kBundleBeams / recordings_.size())) {
      for (std::size_t k = 0; k < beams.size(); ++k) {
        beams[k].push_back(all_[r].shots.rotation_angle[k][row]);
      }
      emitter.push_back(all_[r].shots.beam.empty() ? std::uint8_t{0} : all_[r].shots.beam[row]);
    }
  }
  HeldMovement held;
  if (!result_.held.empty()) held = movement_of(held_, p, result_.held_changes);
  const BeamBundle bundle(p.train, p.free, beams, emitter, held);
  result_.datum = bundle.formal_datum(result_.covariance);
  result_.datum_given_held = bundle.formal_datum(result_.covariance, HeldErrors::left_out);
  result_.datum_without_common =
      bundle.formal_datum(solution.noise_covariance, HeldErrors::left_out);
  result_.pointing_error = bundle.pointing_error(belief_.sensor.train, result_.covariance);
  result_.better_probability = better_probability(result_.pointing_error);
}

}  // namespace

double Calibration::total_sigma(std::size_t parameter) const {
  double variance = covariance(parameter, parameter);
  if (held_changes.cols() > 0) variance += held_changes.row(parameter).squaredNorm();
  return std::sqrt(variance);
}

const CalibratedNumber* Calibration::number(std::string_view name) const {
  const auto found =
      std::ranges::find_if(numbers, [name](const auto& number) { return number.name == name; });
  return found == numbers.end() ? nullptr : &*found;
}

Calibration calibrate(const std::vector<RangedRecording>& recordings,
                      const CalibrationOptions& options, const Progress& progress) {
  return WallCalibration(recordings, options, progress).run();
}

}  // namespace risley::calibration
