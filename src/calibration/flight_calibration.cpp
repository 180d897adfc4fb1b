// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/flight_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/random.hpp"
#include "risley/core/require.hpp"
#include "risley/core/saturating.hpp"
#include "risley/core/setting.hpp"
#include "risley/optics/batch.hpp"
#include "risley/trajectories/clock.hpp"

#include "calibration/eigen_vectors.hpp"
#include "calibration/flight_findings.hpp"
#include "calibration/flight_start.hpp"
#include "calibration/judge_flight.hpp"
#include "calibration/process_check.hpp"
#include "calibration/rough_ground.hpp"
#include "calibration/smooth_ground.hpp"
#include "calibration/verdict.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kCauchy = 1.5;  // median absolute residuals
/// Variance of a normal distribution cut off at the gate.
constexpr double kGatedVariance = 0.97334;
constexpr double kCoarseKnots = 20;     // s
constexpr double kLeastRange = 1e-4;    // smallest sigma that a range is given, m
constexpr double kClockRefresh = 2e-5;  // error of the clock over which poses are extrapolated, s
constexpr double kPoseMargin = 5;       // sigmas of the clock offset
/// Done when a step promises less, in squared sigmas of all unknowns together: shots that come and
/// go at the gate move the result by about as much.
constexpr double kSettled = 0.1;
/// Prior sigmas of tested quantities: drift, s/s, delay, s, and held ones.
constexpr double kDriftPrior = 1e-3, kDelayPrior = 1, kHeldPrior = 1e-2;
/// Beyond this many sigmas of a delay, and if the clock offset is this far from its stated value,
/// the effect of a delay counts as an error of everything else.
constexpr double kDelayConsidered = 2;
/// A trajectory that jumps more often does not fit, nor does one that this many repetitions do not
/// fix.
constexpr std::size_t kMostJumps = 8;
constexpr int kMendings = 8;
/// A jump may be this many sigmas of the process, and this many times its estimate.
constexpr double kBreakSigmas = 3;
/// A process that grows has converged when its corrections require no more than this factor.
constexpr double kProcessRatio = 1.1;

/// Global unknowns that a round adjusts.
enum class Unlocked : std::uint8_t { boresight, prisms, range_and_clock, all };

struct CoarseRound {
  double cell;  // m
  Unlocked unlocked;
  int steps;
};

/// From metres off to centimetres: docs/theory/flight.md
constexpr CoarseRound kCellRounds[] = {
    {10, Unlocked::boresight, 2},       {10, Unlocked::boresight, 2}, {6, Unlocked::boresight, 2},
    {4, Unlocked::boresight, 2},        {4, Unlocked::prisms, 2},     {3, Unlocked::prisms, 2},
    {2.5, Unlocked::range_and_clock, 2}};
constexpr int kAllRounds = 3, kManySteps = 2, kLastSteps = 8;

double flight_seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-9; }

/// Shots, poses and their labels.
struct LabelledFlight {
  FlightShots shots;
  ShotPoses poses;
  ShotPoints points;
  GroundCells cells;
};

class FlightCalibrator {
 public:
  FlightCalibrator(const FlightShots& shots, const trajectories::Trajectory& trajectory,
                   const FlightCalibrationOptions& options, const Progress& progress)
      : options_(options),
        progress_(progress),
        tangent_(trajectories::tangent_frame(trajectory)),
        local_(trajectories::in_tangent_frame(trajectory, tangent_)),
        interpolation_(local_),
        start_(flight_start(options, local_)),
        model_(start_.model),
        priors_(start_.priors) {
    require_flight_shots(shots);
    require_length("rotation_angle", shots.rotation_angle.size(), options_.sensor.prisms());
    check_beams(options_.sensor.train, shots.beam, shots.size());
    const Eigen::Matrix3d to_tangent = tangent_.axes.transpose();
    for (const scenes::KnownGround& ground : options_.control) {
      scenes::require_known_ground(ground);
      PlanePrior& known = control_.emplace_back();
      known.place = to_tangent * (eigen(ground.place) - tangent_.origin);
      known.sigma = ground.sigma;
      if (ground.normal) known.normal = to_tangent * eigen(*ground.normal);
      known.normal_sigma = ground.normal_sigma;
    }
    take_shots(shots);
  }

  FlightCalibration run() {
    find_coarsely();
    progress_.report(0.4);
    adjust_finely();
    progress_.report(0.8);
    mend_trajectory();
    progress_.report(0.93);
    fill_result();
    progress_.report(1);
    return std::move(result_);
  }

 private:
  void take_shots(const FlightShots& shots) {
    result_.shots = shots.size();
    const double margin =
        std::max(1e-3, kPoseMargin * options_.mount.clock_offset.sigma) + 10 * kClockRefresh;
    const std::vector<std::size_t> rows =
        rows_with_pose(shots, interpolation_, options_.mount.clock_offset.value, margin);
    result_.without_pose = shots.size() - rows.size();
    if (rows.empty()) {
      const std::int64_t clock_ns = std::llround(options_.mount.clock_offset.value * 1e9);
      throw EstimationError(
          trajectories::no_overlap_words(local_, saturating_sum(shots.time_ns.front(), clock_ns),
                                         saturating_sum(shots.time_ns.back(), clock_ns)));
    }
    full_.shots = rows.size() == shots.size() ? shots : rows_of(shots, rows);
    if (full_.shots.strip.front() == full_.shots.strip.back()) {
      throw EstimationError(
          "all shots belong to one strip: at least two that overlap are needed, and crossing ones "
          "are best");
    }
    coarse_.shots = sample_of_all(options_.coarse_shots);
  }

  /// About this many shots at random: every n-th one would beat with the rotors.
  FlightShots sample_of_all(std::size_t count) const {
    const FlightShots& all = full_.shots;
    const double share = static_cast<double>(count) / static_cast<double>(all.size());
    if (share >= 1) return all;
    const RandomStream stream(options_.seed, 1700);
    std::vector<std::size_t> some;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (stream.uniform(i) < share) some.push_back(i);
    }
    return rows_of(all, some);
  }

  void hold(Unlocked unlocked);

  FlightWeights weights() const { return flight_weights(options_, priors_, range_variance_); }

  void set_knots(const FlightShots& shots, double spacing) {
    const TrajectoryKnots knots = make_knots(shots, spacing);
    model_.corrections = model_.knots.size() == 0
                             ? MatrixXd::Zero(kCorrections, knots.size())
                             : resampled(model_.knots, model_.corrections, knots);
    model_.knots = knots;
  }

  /// Poses at the model's clock offset, points, cells; each time on another grid.
  /// @param noise  of the cells, m; 0: not known yet
  void label(LabelledFlight& flight, double size, bool rough_too, double noise = 0) {
    const double off = std::abs(flight.poses.clock_offset - model_.clock_offset);
    if (flight.poses.pose.empty() || off > kClockRefresh) {
      flight.poses = poses_of(flight.shots, interpolation_, model_.clock_offset);
    }
    flight.points = georeferenced(flight.shots, flight.poses, model_);
    GroundCellOptions cells;
    cells.size = size;
    cells.shift_east = std::fmod(0.618 * grids_, 1.0);
    cells.shift_north = std::fmod(0.382 * grids_ + 0.5, 1.0);
    ++grids_;
    if (!rough_too) cells.most_roughness = options_.most_roughness;
    cells.noise = noise;
    flight.cells = ground_cells(flight.points, flight.shots.strip, cells);
    take_control(flight, cells);
    grid_ = cells;
    leave_out_jumps(flight);
    if (flight.cells.planes.size() < kFewestCells) {
      throw EstimationError(fmt::format(
          "only {} cells of {:g} m of ground are covered by several strips, at least {} are "
          "needed: do the strips overlap, and do mount and trajectory belong to this flight?",
          flight.cells.planes.size(), size, kFewestCells));
    }
    model_.planes = flight.cells.planes;
  }

  /// Shots between two knots with a jump between them are dropped: corrections are linear there.
  void leave_out_jumps(LabelledFlight& flight) const {
    for (const ProcessBreak& one : priors_.breaks) {
      for (const TrajectoryKnots::Interval& interval : model_.knots.intervals) {
        if (interval.knot != one.knot) continue;
        std::fill(flight.cells.plane.begin() + interval.first_shot,
                  flight.cells.plane.begin() + interval.end_shot, kNoPlane);
      }
    }
  }

  /// Known ground has its own planes, which are fixed to the known values.
  void take_control(LabelledFlight& flight, const GroundCellOptions& cells) {
    priors_.planes.clear();
    control_plane_.clear();
    if (!with_control_ || options_.control.empty()) return;
    std::vector<GroundCircle> circles;
    for (const PlanePrior& known : control_) {
      circles.push_back({known.place, options_.control[circles.size()].radius});
    }
    control_plane_ = add_circles(flight.points, circles, cells, flight.cells);
    for (std::size_t i = 0; i < control_.size(); ++i) {
      if (control_plane_[i] == kNoPlane) continue;
      PlanePrior& known = priors_.planes.emplace_back(control_[i]);
      known.plane = static_cast<std::size_t>(control_plane_[i]);
      GroundPlane& plane = flight.cells.planes[known.plane];
      // Tilts turn about the known place.
      plane.centre = known.place - plane.normal.dot(known.place - plane.centre) * plane.normal;
    }
  }

  FlightAdjustment adjust(const LabelledFlight& flight, const FlightWeights& weights, int steps) {
    progress_.check();
    FlightAdjustmentOptions options;
    options.most_steps = steps;
    options.tolerance = kSettled;
    options.smooth = weights.gate > 0;
    FlightAdjustment adjusted = adjust_flight(flight.shots, flight.poses, flight.cells.plane,
                                              model_, weights, priors_, options);
    model_ = std::move(adjusted.model);
    const VectorXd values = unknown_values(model_);
    if (values.head<3>().norm() > 1 || model_.lever_arm.norm() > 100 ||
        std::abs(model_.clock_offset - options_.mount.clock_offset.value) >
            std::max(1e-3, kPoseMargin * options_.mount.clock_offset.sigma)) {
      throw EstimationError(
          "the adjustment diverged: boresight, lever arm or clock offset are far from the mount's "
          "values. Are the axes of the mount right, and the times of sensor and trajectory?");
    }
    return adjusted;
  }

  void find_coarsely() {
    range_variance_ = stated_range_variance(options_);
    set_knots(coarse_.shots, kCoarseKnots);
    pairs_at_start();
    double done = 0;
    const auto round = [&](double cell, Unlocked unlocked, int steps, bool rough_too) {
      hold(unlocked);
      label(coarse_, cell, rough_too);
      const double scatter =
          std::max(coarse_.cells.scatter, std::sqrt(stated_range_variance(options_)));
      range_variance_ = scatter * scatter;
      FlightWeights own = weights();
      own.cauchy_scale = kCauchy / kSigmaOverMedianDistance * scatter;
      adjust(coarse_, own, steps);
      progress_.report(done += 0.035);
    };
    for (const CoarseRound& own : kCellRounds) round(own.cell, own.unlocked, own.steps, true);
    with_control_ = true;  // before, shots are metres off
    for (int i = 0; i < kAllRounds; ++i) round(options_.cell_size, Unlocked::all, 2, i == 0);
  }

  /// Offsets of the strips with the given values.
  void pairs_at_start() {
    label(coarse_, options_.cell_size, true);
    result_.pairs_before = strip_pairs(coarse_.points, coarse_.shots.strip, coarse_.cells.plane,
                                       coarse_.cells.planes, kInfinity, 3);
    result_.rms_before = rms_of(result_.pairs_before);
  }

  static double rms_of(const std::vector<StripPair>& pairs) {
    double squares = 0, cells = 0;
    for (const StripPair& pair : pairs) {
      squares += pair.rms * pair.rms * static_cast<double>(pair.cells);
      cells += static_cast<double>(pair.cells);
    }
    return cells > 0 ? std::sqrt(squares / cells) : 0;
  }

  /// Contribution of a piece of the flight to the estimate of the ranges' noise from residuals.
  struct PieceScatter {
    double squares = 0;  ///< over the shots' own variance
    double metres2 = 0;  ///< of the residuals
    std::size_t count = 0;
    double time = 0;
  };

  std::vector<PieceScatter> scatter_of(const LabelledFlight& flight, const FlightWeights& weights) {
    std::vector<PieceScatter> pieces(flight_pieces(model_));
    const std::int64_t begin_ns = flight.shots.time_ns.front();
    for_each_flight_piece(
        flight.shots, flight.poses, flight.cells.plane, model_, weights,
        [&](std::size_t piece, const FlightRows& rows) {
          PieceScatter& own = pieces[piece];
          if (rows.begin == rows.end) return;
          own.time = 0.5 * (flight_seconds(flight.shots.time_ns[rows.begin] - begin_ns) +
                            flight_seconds(flight.shots.time_ns[rows.end - 1] - begin_ns));
          const auto columns = static_cast<std::size_t>(rows.columns);
          for (std::size_t i = 0; i < rows.shots.size(); ++i) {
            const double* row = rows.values.data() + (i + 1) * columns - 3;
            if (row[2] == 0) continue;
            own.squares += row[0] * row[0] / row[1];
            own.metres2 += row[0] * row[0];
            ++own.count;
          }
        });
    return pieces;
  }

  void adjust_finely() {
    hold(Unlocked::all);
    const double spacing = final_knot_spacing(options_, model_.knots, full_.shots.strips());
    if (spacing > options_.knot_spacing) {
      warn(result_.warnings, kWarning.coarse_knots,
           "corrections of the trajectory have knots every {:.2f} s instead of {:g} s, because the "
           "flight would need more than {} of them; the sigmas account for errors between them",
           spacing, options_.knot_spacing, options_.most_knots);
    }
    // The trajectory first, with enough shots for it.
    set_knots(coarse_.shots, spacing);
    label(coarse_, options_.cell_size, false);
    const double scatter =
        std::max(coarse_.cells.scatter, std::sqrt(stated_range_variance(options_)));
    range_variance_ = stated_range_variance(options_);
    FlightWeights first = weights();
    first.cauchy_scale = 2 * kCauchy / kSigmaOverMedianDistance * scatter;
    adjust(coarse_, first, 2);
    progress_.report(0.5);
    set_knots(full_.shots, spacing);
    // Then everything. The last round uses the ranges' noise estimated from the residuals.
    cell_noise_ = coarse_.cells.scatter;
    if (full_.shots.size() <= options_.many_shots) {
      fine_round(full_, kManySteps);
      update_range_variance(full_);
    } else {
      LabelledFlight many;
      many.shots = sample_of_all(options_.many_shots);
      set_knots(many.shots, spacing);
      fine_round(many, kManySteps);
      update_range_variance(many);
      set_knots(full_.shots, spacing);
    }
    progress_.report(0.6);
    fine_round(full_, kLastSteps);
  }

  void fine_round(LabelledFlight& flight, int steps) {
    label(flight, options_.cell_size, false, cell_noise_);
    cell_noise_ = flight.cells.scatter;
    final_weights_ = weights();
    final_weights_.gate = kGateSigmas;
    last_ = adjust(flight, final_weights_, steps);
  }

  void update_range_variance(const LabelledFlight& flight) {
    double squares = 0, count = 0;
    for (const PieceScatter& piece : scatter_of(flight, final_weights_)) {
      squares += piece.squares;
      count += static_cast<double>(piece.count);
    }
    const double unknowns = 3 * static_cast<double>(model_.planes.size());
    if (count <= unknowns) return;
    range_variance_ = std::max(range_variance_ * squares / (count - unknowns) / kGatedVariance,
                               kLeastRange * kLeastRange);
  }

  struct TestedSystem {
    FlightModel model;
    FlightPriors priors;
    FlightSystem system;
  };
  TestedSystem tested_system() const;
  bool assumptions_explain() const;
  void mend_trajectory();
  bool known_ground_contradicts() const;
  bool mend_as_needed(const ProcessCheck& check);
  void break_process(const ProcessCheck& check, const std::vector<std::size_t>& jumps);
  void solve_last();
  void fill_trajectory_fit();
  void fill_result();
  void test_assumptions();
  void fill_control();

  const FlightCalibrationOptions& options_;
  const Progress& progress_;
  trajectories::TangentFrame tangent_;
  trajectories::Trajectory local_;
  trajectories::Interpolation interpolation_;
  LabelledFlight full_, coarse_;
  std::vector<PlanePrior> control_;  ///< known ground, in the tangent frame
  std::vector<std::int32_t> control_plane_;
  bool with_control_ = false;
  FlightStart start_;
  FlightModel model_;
  FlightModel smooth_;  ///< at the end, over smooth ground
  FlightPriors priors_;
  double range_variance_ = 0;  // m^2
  double cell_noise_ = 0;      // m
  GroundCellOptions grid_;     ///< of the last labels
  std::optional<RoughGround> rough_;
  trajectories::PoseErrorVector process_factor_ = trajectories::PoseErrorVector::Ones();
  MatrixXd may_be_off_;                 ///< see FlightEvidence
  std::vector<double> break_score_;     ///< [breaks of priors_]
  std::optional<FlightSystem> system_;  ///< of the last equations, over smooth ground
  FlightSystem::Band band_;             ///< of its inverse
  int grids_ = 0;
  FlightAdjustment last_;
  FlightWeights final_weights_;
  FlightCalibration result_;
};

void FlightCalibrator::hold(Unlocked unlocked) {
  priors_.held = held_globals(start_);
  for (std::size_t i = 0; i < priors_.held.size(); ++i) {
    const auto at = static_cast<int>(i);
    bool held = priors_.held[i];
    if (at >= FlightUnknowns::parameter(0)) {
      held = held || unlocked == Unlocked::boresight;
    } else if (at >= FlightUnknowns::range_offset()) {
      held = held || unlocked < Unlocked::range_and_clock;
    } else if (at >= FlightUnknowns::lever_arm(0)) {
      held = held || unlocked < Unlocked::all;
    }
    priors_.held[i] = held;
  }
}

void FlightCalibrator::fill_result() {
  result_.pairs_after =
      strip_pairs(georeferenced(full_.shots, full_.poses, model_), full_.shots.strip,
                  full_.cells.plane, model_.planes, kGateSigmas * std::sqrt(range_variance_));
  result_.rms_after = rms_of(result_.pairs_after);
  result_.used = last_.shots - last_.outliers - last_.lost;
  result_.outliers = last_.outliers + last_.lost;
  result_.cells = full_.cells.planes.size();
  result_.rough_cells = full_.cells.rough;
  result_.range_sigma = std::sqrt(range_variance_);
  result_.sigma0 = std::sqrt(range_variance_ / stated_range_variance(options_));
  for (const PieceScatter& piece : scatter_of(full_, final_weights_)) {
    if (piece.count == 0) continue;
    result_.piece_time.push_back(piece.time);
    result_.piece_rms.push_back(std::sqrt(piece.metres2 / static_cast<double>(piece.count)));
  }
  rough_ = rough_ground(full_.shots, full_.poses, full_.cells.plane, full_.points, grid_, model_,
                        final_weights_);
  if (rough_) result_.roughness = std::sqrt(rough_->covariance.diagonal().mean());
  test_assumptions();
  static_cast<FlightJudgement&>(result_) =
      judge_flight({full_.shots, full_.poses, full_.cells.plane, smooth_, final_weights_, priors_,
                    start_.prior_sigma, start_.considered, *system_, &band_.diagonal, may_be_off_,
                    rough_ ? &*rough_ : nullptr});
  fill_mount_and_sensor(options_, model_, priors_.held, start_.considered, result_);
  judge_clock_offset(result_);
  fill_trajectory_fit();
  fill_control();
  result_.trajectory = trajectories::from_tangent_frame(
      corrected(local_, model_, priors_.process, result_.correction_sigma), tangent_);
  result_.tangent = tangent_;
  result_.converged = last_.converged && result_.reason.empty();
  if (!last_.converged && result_.reason.empty()) {
    result_.reason = fmt::format(
        "the adjustment had not converged: its last step still gained {:.2g} squared sigmas",
        last_.promised);
  }
  result_.model = std::move(model_);
  result_.tolerance = options_.tolerance.value_or(options_.sensor.pointing_tolerance);
  if (result_.converged) result_.pointing_error = pointing_error_of(result_);
  result_.verdict = verdict_of(result_);
}

/// The last equations, and the part of their inverse common to neighbouring knots.
void FlightCalibrator::solve_last() {
  progress_.check();
  smooth_ = model_;
  smooth_.planes = smooth_ground(
      model_.planes, tilt_information(model_.planes.size(),
                                      flight_equations(full_.shots, full_.poses, full_.cells.plane,
                                                       model_, final_weights_)));
  system_.emplace(
      flight_equations(full_.shots, full_.poses, full_.cells.plane, smooth_, final_weights_),
      smooth_, priors_);
  band_ = system_->inverse_band();
}

/// Compares the corrections with their stated process, and repeats the adjustment until they agree:
/// jumps get separate steps, and a process larger than stated gets its actual size.
void FlightCalibrator::mend_trajectory() {
  TrajectoryFit& fit = result_.trajectory_fit;
  for (int mended = 0;; ++mended) {
    solve_last();
    const ProcessCheck check = check_process(model_.knots, model_.corrections, priors_, band_);
    if (mended == 0) {
      std::copy_n(check.chi2.data(), kCorrections, fit.chi2.begin());
      std::copy_n(check.expected.data(), kCorrections, fit.expected.begin());
    }
    // Wrong known ground bends the trajectory: it is reported, and no other cause is considered.
    if (known_ground_contradicts()) return;
    const bool fits = jumps_of(model_.knots, check).empty() &&
                      process_factors(model_.knots, check) == VectorXd::Ones(kCorrections);
    if (mended == 0 && (fits || assumptions_explain())) return;
    if (mended == kMendings || !mend_as_needed(check)) {
      fit.fits = fits;
      return;
    }
    fine_round(full_, kLastSteps);
  }
}

bool FlightCalibrator::known_ground_contradicts() const {
  return std::ranges::any_of(priors_.planes, [&](const PlanePrior& known) {
    const GroundPlane& plane = model_.planes[known.plane];
    return std::abs(plane.normal.dot(plane.centre - known.place)) > kTestedSigmas * known.sigma;
  });
}

/// @return whether anything has changed, so that the adjustment must be repeated
bool FlightCalibrator::mend_as_needed(const ProcessCheck& check) {
  const std::vector<std::size_t> jumps = jumps_of(model_.knots, check);
  // A process larger than stated is enlarged iteratively to its size.
  const bool alerted = process_factor_ != trajectories::PoseErrorVector::Ones();
  const VectorXd factors = process_factors(model_.knots, check, alerted);
  const bool large = factors.maxCoeff() > (alerted ? kProcessRatio : 1);
  // Steps of a process that is larger than stated look like jumps.
  if (!large && !jumps.empty() && priors_.breaks.size() + jumps.size() <= kMostJumps) {
    break_process(check, jumps);
    return true;
  }
  if (!large) return false;
  trajectories::PoseErrorVector on_process = trajectories::PoseErrorVector::Ones();
  for (int c = 0; c < kCorrections; ++c) on_process[static_cast<Index>(error_of(c))] = factors[c];
  process_factor_ = process_factor_.cwiseProduct(on_process);
  priors_.process = priors_.process.scaled(on_process);
  return true;
}

void FlightCalibrator::break_process(const ProcessCheck& check,
                                     const std::vector<std::size_t>& jumps) {
  for (const std::size_t knot : jumps) {
    const auto step = static_cast<Index>(knot);
    ProcessBreak one{.knot = knot};
    for (int c = 0; c < kCorrections; ++c) {
      const double usual =
          priors_.process.sigmas(model_.knots.time_ns[knot])[static_cast<Index>(error_of(c))];
      one.sigma[c] = kBreakSigmas * std::max(usual, std::abs(check.jump(c, step)));
    }
    priors_.breaks.push_back(one);
    break_score_.push_back(check.score.col(step).cwiseAbs().maxCoeff());
  }
}

/// Equations with a free clock drift, a free delay of attitudes, and free held quantities.
FlightCalibrator::TestedSystem FlightCalibrator::tested_system() const {
  const std::vector<std::int64_t>& times = full_.shots.time_ns;
  FlightModel model = smooth_;
  model.drift_about_ns = times.front() + (times.back() - times.front()) / 2;
  model.attitude_delay = true;
  const Index drift = model.unknowns().clock_drift(), delay = model.unknowns().attitude_delay(),
              size = model.unknowns().size();
  FlightPriors priors = priors_;
  priors.mean.conservativeResizeLike(VectorXd::Zero(size));
  priors.information.conservativeResizeLike(MatrixXd::Zero(size, size));
  priors.information(drift, drift) = 1 / (kDriftPrior * kDriftPrior);
  priors.information(delay, delay) = 1 / (kDelayPrior * kDelayPrior);
  priors.held.resize(size, false);
  for (Index i = drift - static_cast<Index>(start_.considered); i < drift; ++i) {
    priors.information(i, i) = 1 / (kHeldPrior * kHeldPrior);
    priors.held[i] = false;
  }
  FlightSystem system(
      flight_equations(full_.shots, full_.poses, full_.cells.plane, model, final_weights_), model,
      priors);
  return {std::move(model), std::move(priors), std::move(system)};
}

/// Whether corrections fit their process once the tested quantity is free: then it is the cause,
/// not the trajectory.
bool FlightCalibrator::assumptions_explain() const {
  const TestedSystem tested = tested_system();
  const VectorXd step = tested.system.step().unknowns;
  const MatrixXd corrections =
      model_.corrections +
      Eigen::Map<const MatrixXd>(step.data(), kCorrections, model_.knots.size());
  const ProcessCheck check =
      check_process(model_.knots, corrections, priors_, tested.system.inverse_band());
  return jumps_of(model_.knots, check).empty() &&
         process_factors(model_.knots, check) == VectorXd::Ones(kCorrections);
}

/// The next step with these equations, and its uncertainty.
void FlightCalibrator::test_assumptions() {
  const auto [model, priors, system] = tested_system();
  const auto considered = static_cast<Index>(start_.considered);
  const Index size = model.unknowns().size(), first = model.unknowns().clock_drift() - considered;
  const Index tested = considered + 2, at = system.size() - tested;
  MatrixXd functionals = MatrixXd::Zero(system.size(), tested);
  functionals.bottomRows(tested).setIdentity();
  const VectorXd steps = system.step().unknowns.segment(at, tested);
  const MatrixXd covariance =
      flight_covariance(full_.shots, full_.poses, full_.cells.plane, model, final_weights_, priors,
                        system, functionals, rough_ ? &*rough_ : nullptr);
  judge_clock_drift(steps[considered], std::sqrt(covariance(considered, considered)),
                    flight_seconds(full_.shots.time_ns.back() - full_.shots.time_ns.front()),
                    result_);
  judge_attitude_delay(steps[considered + 1], std::sqrt(covariance(considered + 1, considered + 1)),
                       result_);
  const AttitudeDelay& late = result_.attitude_delay;
  const auto clock = static_cast<Index>(FlightUnknowns::clock_offset());
  const double clock_off = std::abs(model_.clock_offset - options_.mount.clock_offset.value);
  if (std::abs(late.value) > kDelayConsidered * late.sigma ||
      (!priors_.held[clock] && clock_off > kDelayConsidered * start_.prior_sigma[clock])) {
    // Shift of everything else if the delay is free.
    const VectorXd moves = system.solve(VectorXd::Unit(system.size(), system.size() - 1));
    may_be_off_ = std::hypot(late.value, late.sigma) / moves[moves.size() - 1] *
                  moves.segment(system.size() - size, model_.unknowns().size());
  }
  const std::vector<std::string> names = unknown_names(model_);
  const VectorXd values = unknown_values(model_);
  for (Index i = 0; i < considered; ++i) {
    const Index row = first + i;
    judge_held({.name = names[row],
                .held = values[row],
                .stated_sigma = start_.prior_sigma[row],
                .from_flight = values[row] + steps[i],
                .sigma = std::sqrt(covariance(i, i))},
               options_.sensor, result_);
  }
}

/// Changes made to the trajectory, in numbers and words.
void FlightCalibrator::fill_trajectory_fit() {
  TrajectoryFit& fit = result_.trajectory_fit;
  for (int c = 0; c < kCorrections; ++c) {
    fit.factor[c] = process_factor_[static_cast<Index>(error_of(c))];
  }
  const TrajectoryKnots& knots = model_.knots;
  for (std::size_t i = 0; i < priors_.breaks.size(); ++i) {
    const std::size_t knot = priors_.breaks[i].knot;
    TrajectoryJump& jump = fit.jumps.emplace_back();
    jump.begin_ns = knots.time_ns[knot];
    jump.end_ns = knots.time_ns[knot + 1];
    jump.strip = knots.strip[knot];
    jump.between_strips = knots.strip[knot] != knots.strip[knot + 1];
    jump.score = break_score_[i];
    for (int c = 0; c < kCorrections; ++c) {
      const Index at = kCorrections * knot + c, next = at + kCorrections;
      const double change =
          model_.corrections(c, static_cast<Index>(knot) + 1) - model_.corrections(c, knot);
      // Corrections turn about up, and headings about down.
      jump.size[c] = error_of(c) == trajectories::PoseError::heading ? change : -change;
      jump.sigma[c] =
          std::sqrt(std::max(0.0, band_.diagonal[at] + band_.diagonal[next] - 2 * band_.next[at]));
    }
  }
  std::ranges::sort(fit.jumps, [](const TrajectoryJump& a, const TrajectoryJump& b) {
    return a.begin_ns < b.begin_ns;
  });
  warn_of_trajectory(full_.shots.time_ns.front(), result_);
}

void FlightCalibrator::fill_control() {
  for (std::size_t i = 0; i < control_.size(); ++i) {
    SeenControl seen;
    const scenes::KnownGround& ground = options_.control[i];
    seen.name = ground.name;
    seen.sigma = ground.sigma;
    const GroundCircle circle{control_[i].place, ground.radius};
    seen.shots = static_cast<std::size_t>(std::ranges::count_if(
        full_.points, [&](const std::array<float, 3>& point) { return circle.holds(point); }));
    seen.used = control_plane_[i] != kNoPlane;
    if (seen.used) {
      const GroundPlane& plane = model_.planes[control_plane_[i]];
      seen.off = plane.normal.dot(plane.centre - control_[i].place);
    }
    judge_control(ground, std::move(seen), result_);
  }
}

}  // namespace

FlightCalibration calibrate_flight(const FlightShots& shots,
                                   const trajectories::Trajectory& trajectory,
                                   const FlightCalibrationOptions& options,
                                   const Progress& progress) {
  return FlightCalibrator(shots, trajectory, options, progress).run();
}

}  // namespace risley::calibration
