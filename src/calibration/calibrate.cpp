// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "risley/calibration/calibration_plan.hpp"
#include "risley/calibration/paper_adjustment.hpp"
#include "risley/calibration/plane_segmentation.hpp"
#include "risley/calibration/surface_steps.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

#include "calibration/belief.hpp"
#include "calibration/shot_labels.hpp"
#include "calibration/wall_matching.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kCoarseShots = 40000;   // of all recordings together, to find the planes with
constexpr std::size_t kBundleBeams = 4000;    // for formal sigmas of the beams
constexpr std::size_t kPictureShots = 20000;  // for pictures
constexpr int kCoarseRounds = 5;
constexpr int kMostFullRounds = 5;
/// A plane is a step of a larger one when this part of its points lies near that.
constexpr double kStepShare = 0.9;
/// Variance of a normal distribution cut off at the gate.
constexpr double kVarianceWithinGate = 0.97334;
/// How far directions may be bent before the first adjustment, 1 sigma.
constexpr double kStartPointing = radians_from_degrees(0.1);
constexpr double kLeastRangeSigma = 1e-7;  // m

/// Variance component of every view: what its residuals say of the range noise.
void update_range_variances(PlanarSolution& solution) {
  for (std::size_t v = 0; v < solution.chi2.size(); ++v) {
    if (solution.redundancy[v] < 30) continue;
    const double factor = solution.chi2[v] / solution.redundancy[v] / kVarianceWithinGate;
    double& variance = solution.problem.views[v].range_variance;
    variance = std::max(variance * factor, kLeastRangeSigma * kLeastRangeSigma);
  }
}

/// A smaller plane a few sigmas off a larger one is a step of it: two planes that nearly coincide
/// could not share out their shots.
void absorb_steps(const std::vector<Vector3<double>>& points, const SegmentationOptions& settings,
                  Segmentation& segmentation) {
  for (std::size_t k = segmentation.planes.size(); k-- > 1;) {
    bool step = false;
    for (std::size_t larger = 0; larger < k && !step; ++larger) {
      const Plane& plane = segmentation.planes[larger];
      double near = 0, all = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (segmentation.label[i] != static_cast<int>(k)) continue;
        all += 1.0;
        near += std::abs(signed_distance(plane, points[i])) <=
                        kNearby * distance_sigma(plane, points[i], settings)
                    ? 1.0
                    : 0.0;
      }
      step = near >= kStepShare * all;
    }
    if (!step) continue;
    const auto at = static_cast<std::ptrdiff_t>(k);
    segmentation.planes.erase(segmentation.planes.begin() + at);
    segmentation.points.erase(segmentation.points.begin() + at);
    for (int& label : segmentation.label) {
      if (label == static_cast<int>(k)) {
        label = -1;
      } else if (label > static_cast<int>(k)) {
        --label;
      }
    }
  }
}

/// One run, from recordings to results.
class Work {
 public:
  Work(const std::vector<RangedRecording>& recordings, const CalibrationOptions& options,
       const Progress& progress)
      : recordings_(recordings), options_(options), progress_(progress) {
    if (recordings.empty()) throw InvalidArgument("no recording to calibrate on");
    if (!options.stations.empty() && options.stations.size() != recordings.size()) {
      throw InvalidArgument(fmt::format("{} stations given for {} recordings",
                                        options.stations.size(), recordings.size()));
    }
    belief_ = pooled_belief(recordings);
    range_noise_ = options.range_noise.value_or(options.sensor.range_noise);
    if (!(range_noise_ > 0)) {
      throw InvalidArgument(fmt::format("range noise = {} m, allowed above 0", range_noise_));
    }
    // Rounding adds its own variance.
    range_noise_ = std::hypot(range_noise_, options.sensor.range_resolution / std::sqrt(12.0));
    for (std::size_t r = 0; r < recordings.size(); ++r) {
      shots_.push_back(recordings[r].shots);
      for (std::size_t k = 0; k < belief_.angle_shift[r].size(); ++k) {
        for (double& angle : shots_[r].rotation_angle[k]) angle += belief_.angle_shift[r][k];
      }
      pointing_.push_back(pointing_of_angles(shots_[r]));
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
    judge(solution);
    progress_.report(1.0);
    return std::move(result_);
  }

 private:
  bool paper() const { return options_.method == CalibrationMethod::paper; }

  void set_up() {
    PlanarProblem& p = problem_;
    p.train = belief_.sensor.train;
    if (options_.beam_origin) p.geometry = options_.sensor.geometry;
    std::vector<std::string> held;
    for (const auto& [name, value] : options_.fixed) held.push_back(name);
    p.free = calibration_parameters(p.train.shape(), held, options_.additional);
    for (const auto& [name, value] : options_.fixed) {
      if (!value) continue;
      for (const int place : find_parameter(name, p.train.shape()).places) {
        p.train.set_place(place, *value);
      }
    }
    p.prior = p.train;
    p.prior_sigma = prior_sigmas(p.free, p.train.shape(), options_.prior_sigma);
    p.range_offset_sigma = options_.range_offset_sigma;
    p.considered = belief_.free;
    p.considered_covariance = belief_.covariance;
    for (const RangedRecording& recording : recordings_) {
      p.angle_sensitivity.push_back(recording.angle_sensitivity);
      p.mean_angle_covariance.push_back(recording.mean_angle_covariance);
    }
  }

  /// Planes in every recording by itself, then which of them are the same wall.
  void find_walls() {
    const std::size_t most = std::max<std::size_t>(kCoarseShots / recordings_.size(), 5000);
    std::vector<FoundPlane> found;
    for (std::size_t r = 0; r < recordings_.size(); ++r) {
      coarse_.push_back(rows_of(shots_[r], spread_rows(shots_[r].size(), most)));
      const Rays rays(problem_.train, problem_.geometry, coarse_[r]);
      std::vector<Vector3<double>> points;
      for (std::size_t i = 0; i < coarse_[r].size(); ++i) {
        points.push_back(rays.point(i, coarse_[r].range[i]));
      }
      SegmentationOptions settings;
      settings.range_noise = range_noise_;
      settings.pointing_noise = std::hypot(kStartPointing, pointing_[r]);
      settings.gate = kGate;
      settings.leave_out_edges = true;
      settings.seed = options_.seed + r;
      Segmentation segmentation = segment_planes(points, settings);
      absorb_steps(points, settings, segmentation);
      for (std::size_t i = 0; i < segmentation.planes.size(); ++i) {
        found.push_back({r, segmentation.planes[i], segmentation.points[i], 0});
      }
      start_labels_.push_back(segmentation.label);
      if (segmentation.planes.empty()) {
        const std::string why = fmt::format(
            "{}: no plane found among {} points{}", recordings_[r].name, points.size(),
            segmentation.on_one_line
                ? ": what is flat in them lies on one line, and a wall has to fill an area"
                : "");
        if (recordings_.size() == 1) throw EstimationError(why);
        result_.warnings.push_back(why + "; it is left out");
      }
    }
    if (found.empty()) throw EstimationError("no plane found in any recording");
    std::vector<std::string> names;
    for (const RangedRecording& recording : recordings_) names.push_back(recording.name);
    // The paper's method knows no datum.
    WallMatching matching = paper() ? match_walls(found, names, std::nullopt, {})
                                    : match_walls(found, names, options_.planes, options_.stations);
    problem_.walls = std::move(matching.walls);
    problem_.stations = std::move(matching.stations);
    problem_.stations_known = matching.stations_known;
    result_.warnings.insert(result_.warnings.end(), matching.warnings.begin(),
                            matching.warnings.end());
    const bool planes = std::any_of(problem_.walls.begin(), problem_.walls.end(),
                                    [](const Wall& wall) { return wall.normal_sigma >= 0; });
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
      for (int& label : start_labels_[r]) {
        if (label >= 0) label += static_cast<int>(first_view[r]);
      }
      hand_out(coarse_[r], start_labels_[r], r, problem_);
    }
  }

  PlanarSolution solve(const PlanarProblem& problem) {
    solved_variance_.clear();
    for (const WallView& view : problem.views) solved_variance_.push_back(view.range_variance);
    return paper() ? adjust_as_paper(problem) : adjust(problem);
  }

  /// Views that lost their shots when labels changed are no views any more.
  void drop_empty_views(PlanarProblem& problem) const {
    std::erase_if(problem.views, [](const WallView& view) { return view.shots->size() < 30; });
    if (problem.views.empty()) {
      throw EstimationError("no plane is left once every shot went to the plane it fits best");
    }
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
        hand_out(coarse_[r], label_shots(problem_, r, coarse_[r], pointing_[r]).view, r, problem_);
      }
      drop_empty_views(problem_);
    }
  }

  void label_all() {
    near_.assign(problem_.views.size(), 0);
    labels_.clear();
    nearby_.clear();
    for (std::size_t r = 0; r < recordings_.size(); ++r) {
      Labels labels = label_shots(problem_, r, shots_[r], pointing_[r]);
      for (std::size_t v = 0; v < near_.size(); ++v) near_[v] += labels.near[v];
      labels_.push_back(std::move(labels.view));
      nearby_.push_back(std::move(labels.nearby));
    }
  }

  PlanarSolution adjust_fully() {
    label_all();
    for (std::size_t r = 0; r < recordings_.size(); ++r) {
      hand_out(shots_[r], labels_[r], r, problem_);
    }
    // The first solution bends towards steps and hides their rims: labels and solution take turns
    // until what is left out stays the same.
    PlanarSolution solution;
    std::size_t left_out = 0;
    bool settled = false;
    for (int round = 0; round < kMostFullRounds; ++round) {
      solution = solve(problem_);
      update_range_variances(solution);
      problem_ = solution.problem;
      progress_.report(0.5 + 0.08 * (round + 1));
      if (settled || round + 1 == kMostFullRounds) break;
      label_all();
      const std::size_t before = std::exchange(left_out, leave_out_steps());
      settled = std::max(before, left_out) - std::min(before, left_out) <= left_out / 100;
      for (std::size_t r = 0; r < recordings_.size(); ++r) {
        hand_out(shots_[r], labels_[r], r, problem_);
      }
    }
    judge_evenness();
    return solution;
  }

  /// Residuals of one view's shots as distances from its plane.
  struct Distances {
    std::vector<double> azimuth, zenith, distance, sigma, incidence;
    std::vector<std::size_t> rows;  ///< of the recording
  };

  /// @param labels  labels_ or nearby_
  Distances distances_of(const PlanarProblem& problem, std::size_t view,
                         const std::vector<std::vector<int>>& labels) const {
    const std::size_t r = problem.views[view].recording;
    Distances d;
    for (std::size_t i = 0; i < labels[r].size(); ++i) {
      if (labels[r][i] == static_cast<int>(view)) d.rows.push_back(i);
    }
    const RangedShots shots = rows_of(shots_[r], d.rows);
    const PlaneView plane = plane_view(problem, view);
    const Rays rays(problem.train, problem.geometry, shots);
    const double pointing = pointing_[r];
    for (std::size_t i = 0; i < shots.size(); ++i) {
      const Vector3<double> direction = rays.direction(i);
      const auto angles = angles_from_direction(direction);
      const double cosine = dot(plane.plane.normal, direction);
      const double range = shots.range[i] - plane.range_offset;
      const double across = pointing * range * std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
      d.azimuth.push_back(angles.azimuth);
      d.zenith.push_back(angles.zenith);
      d.distance.push_back(signed_distance(plane.plane, rays.point(i, range)));
      d.sigma.push_back(std::sqrt(plane.range_variance * cosine * cosine + across * across));
      d.incidence.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)));
    }
    return d;
  }

  /// Takes regions that stand off their wall out of the labels. They are looked for among the
  /// outliers too, where most shots of a larger step are. @return number of their shots
  std::size_t leave_out_steps() {
    result_.steps.clear();
    std::size_t shots = 0;
    if (paper()) return shots;
    for (std::size_t v = 0; v < problem_.views.size(); ++v) {
      const std::size_t r = problem_.views[v].recording;
      const Distances d = distances_of(problem_, v, nearby_);
      for (const StepRegion& step :
           inspect_surface({d.azimuth, d.zenith, d.distance, d.sigma}).steps) {
        for (const std::size_t row : step.rows) labels_[r][d.rows[row]] = -1;
        shots += step.rows.size();
        result_.steps.push_back({r, v, step.height, step.azimuth, step.zenith,
                                 std::sqrt(step.solid_angle), step.points});
      }
    }
    return shots;
  }

  /// How far means over the walls scatter beyond noise.
  void judge_evenness() {
    double squares = 0, cells = 0;
    for (std::size_t v = 0; v < problem_.views.size(); ++v) {
      const Distances d = distances_of(problem_, v, labels_);
      const SurfaceReport report = inspect_surface({d.azimuth, d.zenith, d.distance, d.sigma});
      squares += report.unevenness * static_cast<double>(report.cells);
      cells += static_cast<double>(report.cells);
    }
    if (cells == 0) return;
    result_.unevenness = squares / cells;
    const double significant = 1.0 + 4.0 * std::sqrt(2.0 / cells);
    result_.variance_factor = result_.unevenness > significant ? result_.unevenness : 1.0;
  }

  /// RMS of point-to-plane distances of a view with other optics, and the distances; the plane is
  /// fitted to them.
  std::pair<double, std::vector<double>> thickness(const PrismTrain& train,
                                                   const RangedShots& shots) const {
    const Rays rays(train, problem_.geometry, shots);
    std::vector<Vector3<double>> points;
    for (std::size_t i = 0; i < shots.size(); ++i) points.push_back(rays.point(i, shots.range[i]));
    std::vector<std::size_t> all(points.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    const Plane plane = fitted_plane(points, all);
    std::vector<double> distance;
    double squares = 0;
    for (const Vector3<double>& point : points) {
      distance.push_back(signed_distance(plane, point));
      squares += distance.back() * distance.back();
    }
    return {std::sqrt(squares / static_cast<double>(points.size())), std::move(distance)};
  }

  void fill_result(const PlanarSolution& solution);
  void fill_planes(const PlanarSolution& solution);
  void fill_sensor(const PlanarSolution& solution);
  void judge(const PlanarSolution& solution);

  const std::vector<RangedRecording>& recordings_;
  const CalibrationOptions& options_;
  const Progress& progress_;
  Belief belief_;
  double range_noise_ = 0;
  std::vector<RangedShots> shots_, coarse_;                       // [recordings]
  std::vector<double> pointing_;                                  // [recordings]
  std::vector<std::vector<int>> start_labels_, labels_, nearby_;  // [recordings][shots]
  std::vector<std::size_t> near_;
  std::vector<double> solved_variance_;  // [views] of the last solve, m^2
  PlanarProblem problem_;
  Calibration result_;
};

/// Root mean squares and means over bins of a variable.
class ProfileBuilder {
 public:
  ProfileBuilder(std::string variable, double from, double to, std::size_t bins)
      : from_(from), width_((to - from) / static_cast<double>(bins)), sums_(bins) {
    profile_.variable = std::move(variable);
  }
  void add(double at, double before, double after) {
    const double bin = std::floor((at - from_) / width_);
    if (!(bin >= 0) || bin >= static_cast<double>(sums_.size())) return;
    Sums& s = sums_[static_cast<std::size_t>(bin)];
    ++s.count;
    s.before += before;
    s.after += after;
    s.before2 += before * before;
    s.after2 += after * after;
  }
  ThicknessProfile result() && {
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      const Sums& s = sums_[i];
      const double n = s.count > 0 ? static_cast<double>(s.count) : kNaN;
      profile_.from.push_back(from_ + width_ * static_cast<double>(i));
      profile_.to.push_back(from_ + width_ * static_cast<double>(i + 1));
      profile_.count.push_back(s.count);
      profile_.rms_before.push_back(std::sqrt(s.before2 / n));
      profile_.rms_after.push_back(std::sqrt(s.after2 / n));
      profile_.mean_before.push_back(s.before / n);
      profile_.mean_after.push_back(s.after / n);
    }
    return std::move(profile_);
  }

 private:
  struct Sums {
    std::size_t count = 0;
    double before = 0, after = 0, before2 = 0, after2 = 0;
  };
  double from_, width_;
  std::vector<Sums> sums_;
  ThicknessProfile profile_;
};

void Work::fill_planes(const PlanarSolution& solution) {
  const PlanarProblem& p = solution.problem;
  const auto prisms = static_cast<std::size_t>(p.train.prisms());
  std::vector<ProfileBuilder> builders;
  builders.emplace_back("incidence", 0.0, kPi / 2, 45);
  for (std::size_t k = 0; k < prisms; ++k) {
    builders.emplace_back(fmt::format("rotation_angle_{}", prism_letter(static_cast<int>(k))), 0.0,
                          kTwoPi, 72);
  }
  double before2 = 0, after2 = 0;
  std::vector<std::vector<double>> before_of(recordings_.size()), after_of(recordings_.size());
  for (std::size_t r = 0; r < recordings_.size(); ++r) {
    before_of[r].assign(shots_[r].size(), kNaN);
    after_of[r].assign(shots_[r].size(), kNaN);
  }
  for (std::size_t v = 0; v < p.views.size(); ++v) {
    const std::size_t r = p.views[v].recording;
    const Distances d = distances_of(p, v, labels_);
    const RangedShots shots = rows_of(shots_[r], d.rows);
    const auto [rms_before, before] = thickness(belief_.sensor.train, shots);
    CalibratedPlane plane;
    plane.name = p.walls[p.views[v].wall].name;
    plane.recording = r;
    const PlaneView view = plane_view(p, v);
    plane.normal = view.plane.normal;
    plane.distance = view.plane.distance;
    plane.points = d.rows.size();
    plane.outliers = near_[v];
    plane.rms_before = rms_before;
    plane.range_sigma = std::sqrt(p.views[v].range_variance);
    double squares = 0;
    for (std::size_t i = 0; i < d.rows.size(); ++i) {
      squares += d.distance[i] * d.distance[i];
      before_of[r][d.rows[i]] = before[i];
      after_of[r][d.rows[i]] = d.distance[i];
      builders[0].add(d.incidence[i], before[i], d.distance[i]);
      for (std::size_t k = 0; k < prisms; ++k) {
        builders[k + 1].add(wrap_to_two_pi(shots.rotation_angle[k][i]), before[i], d.distance[i]);
      }
    }
    const auto n = static_cast<double>(d.rows.size());
    plane.rms = std::sqrt(squares / n);
    before2 += n * rms_before * rms_before;
    after2 += squares;
    result_.points += d.rows.size();
    result_.planes.push_back(std::move(plane));
  }
  result_.rms_before = std::sqrt(before2 / static_cast<double>(result_.points));
  result_.rms_after = std::sqrt(after2 / static_cast<double>(result_.points));
  for (ProfileBuilder& builder : builders) {
    result_.profiles.push_back(std::move(builder).result());
  }
  for (std::size_t r = 0; r < recordings_.size(); ++r) {
    const std::vector<std::size_t> rows =
        spread_rows(shots_[r].size(), kPictureShots / recordings_.size());
    const RangedShots shots = rows_of(shots_[r], rows);
    const Rays rays(p.train, p.geometry, shots);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto angles = angles_from_direction(rays.direction(i));
      result_.sample.push_back(
          {r, labels_[r][rows[i]], rays.point(i, shots.range[i] - p.range_offset),
           before_of[r][rows[i]], after_of[r][rows[i]], angles.azimuth, angles.zenith});
    }
  }
}

void Work::fill_sensor(const PlanarSolution& solution) {
  sensors::Sensor& sensor = result_.sensor;
  sensor = options_.sensor;
  sensor.serial = recordings_.front().serial;
  sensor.train = solution.problem.train;
  sensor.angular_velocity = belief_.sensor.angular_velocity;
  sensor.combination = belief_.sensor.combination;
  sensor.provenance.clear();
  sensor.covariance_names.clear();
  if (!options_.beam_origin) sensor.set_prism_geometry({});
  for (const sensors::Knowledge& known : belief_.sensor.knowledge) {
    const bool speed = known.name.starts_with("angular_velocity");
    const bool material = known.name.starts_with("refractive_index");
    if (speed || material) sensor.set_knowledge(known);
  }
  for (std::size_t j = 0; j < result_.free.size(); ++j) {
    const auto at = static_cast<Index>(j);
    sensor.covariance_names.push_back(result_.free[j].name);
    sensor.set_knowledge({result_.free[j].name, std::sqrt(result_.covariance(at, at)),
                          "calibrated on plane walls by risley calibrate"});
  }
  sensor.reference = sensors::CalibrationReference::planes;
  sensor.covariance = result_.covariance;
  sensor.range_offset = solution.problem.range_offset;
  std::erase_if(sensor.knowledge,
                [](const sensors::Knowledge& entry) { return entry.name == "range_offset_m"; });
  if (!(result_.range_offset_sigma > 0)) return;
  const Index n = result_.covariance.rows();
  sensor.covariance_names.emplace_back("range_offset_m");
  sensor.set_knowledge({"range_offset_m", result_.range_offset_sigma,
                        "calibrated on plane walls by risley calibrate"});
  sensor.covariance.conservativeResize(n + 1, n + 1);
  sensor.covariance.col(n).head(n) = solution.range_offset_covariance * result_.variance_factor;
  sensor.covariance.row(n).head(n) = sensor.covariance.col(n).head(n).transpose();
  sensor.covariance(n, n) = result_.range_offset_sigma * result_.range_offset_sigma;
}

void Work::fill_result(const PlanarSolution& solution) {
  const PlanarProblem& p = solution.problem;
  result_.method = options_.method;
  result_.believed = belief_.sensor.train;
  result_.angle_shift = belief_.angle_shift;
  result_.free = p.free;
  result_.parameters = solution.parameters;
  result_.covariance = solution.covariance * result_.variance_factor;
  result_.range_offset = p.range_offset;
  result_.range_offset_sigma = solution.range_offset_sigma * std::sqrt(result_.variance_factor);
  result_.prior_tests = solution.prior_tests;
  result_.unobservable = estimation::weak_directions(
      solution.information / result_.variance_factor + prior_information(p), p.free,
      kWidestDirection);
  double stated = 0, redundancy = 0;
  for (std::size_t v = 0; v < p.views.size(); ++v) {
    stated += solution.chi2[v] * solved_variance_[v];
    redundancy += solution.redundancy[v];
  }
  result_.sigma0 = std::sqrt(stated / redundancy / kVarianceWithinGate) / range_noise_;
  fill_planes(solution);
  fill_sensor(solution);
  std::vector<std::vector<double>> beams(static_cast<std::size_t>(p.train.prisms()));
  std::vector<std::uint8_t> emitter;
  for (std::size_t r = 0; r < recordings_.size(); ++r) {
    for (const std::size_t row : spread_rows(shots_[r].size(), kBundleBeams / recordings_.size())) {
      for (std::size_t k = 0; k < beams.size(); ++k) {
        beams[k].push_back(shots_[r].rotation_angle[k][row]);
      }
      emitter.push_back(shots_[r].beam.empty() ? std::uint8_t{0} : shots_[r].beam[row]);
    }
  }
  result_.datum = formal_datum(p.train, p.free, result_.covariance, beams, emitter);
  result_.datum_without_common = formal_datum(
      p.train, p.free, solution.noise_covariance * result_.variance_factor, beams, emitter);
}

void Work::judge(const PlanarSolution& solution) {
  Calibration& c = result_;
  c.converged = solution.converged && c.covariance.allFinite();
  if (!c.converged) c.reason = "the adjustment did not converge";
  if (!c.unobservable.empty()) {
    c.converged = false;
    c.reason = fmt::format(
        "the walls do not tell {}, only to {:.2g} degrees: walls tilted by 30 degrees and more "
        "against the axis do, or a prior (option prior_sigma)",
        estimation::direction_text(c.unobservable.front()), c.unobservable.front().sigma);
  }
  const PriorTest* worst = nullptr;
  for (const PriorTest& test : c.prior_tests) {
    if (test.degrees_of_freedom == 0 || test.chi2 <= test.critical) continue;
    if (worst == nullptr || test.chi2 > worst->chi2) worst = &test;
  }
  if (worst != nullptr) {
    c.converged = false;
    c.reason = fmt::format(
        "{} {} contradicts the data: what is stated of it is off by {:.3g} degrees, chi2 {:.3g} "
        "where {:.3g} is the limit",
        worst->station ? "station" : "plane", worst->name, degrees_from_radians(worst->misfit),
        worst->chi2, worst->critical);
    std::string others;
    for (const PriorTest& test : c.prior_tests) {
      if (&test == worst || test.degrees_of_freedom == 0 || test.chi2 <= test.critical) continue;
      others += (others.empty() ? "" : ", ") + test.name;
    }
    if (!others.empty()) {
      c.reason += fmt::format("; so do {}: they contradict each other", others);
    }
  }
  const double boresight = std::hypot(c.datum.sigma_pitch, c.datum.sigma_yaw);
  if (boresight > kPoorDatum) {
    c.warnings.push_back(fmt::format(
        "the direction that all beams share is only known to {:.2g} degrees (pitch {:.2g}, yaw "
        "{:.2g}); their directions against each other to {:.2g}",
        degrees_from_radians(boresight), degrees_from_radians(c.datum.sigma_pitch),
        degrees_from_radians(c.datum.sigma_yaw), degrees_from_radians(c.datum.shape)));
  }
  for (const SurfaceStep& step : c.steps) {
    c.warnings.push_back(fmt::format(
        "{}: a region of {:.2g} degrees stands {:.0f} mm off plane {} (azimuth {:.1f}, zenith "
        "{:.1f}); its {} shots are left out",
        recordings_[step.recording].name, degrees_from_radians(step.size), 1e3 * step.height,
        c.planes[step.plane].name, degrees_from_radians(step.azimuth),
        degrees_from_radians(step.zenith), step.points));
  }
  if (c.variance_factor > 1.0) {
    c.warnings.push_back(
        fmt::format("the walls are uneven: means over a square degree scatter {:.2g} times as much "
                    "as the noise "
                    "allows; variances are enlarged by that, and boresight may be off by more",
                    c.unevenness));
  }
  if (solution.lost > 0) {
    c.warnings.push_back(fmt::format("{} shots do not meet their plane", solution.lost));
  }
}

}  // namespace

Calibration calibrate(const std::vector<RangedRecording>& recordings,
                      const CalibrationOptions& options, const Progress& progress) {
  return Work(recordings, options, progress).run();
}

}  // namespace risley::calibration
