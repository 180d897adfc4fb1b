// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/flight_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "risley/algebra/symmetric.hpp"
#include "risley/calibration/calibration_plan.hpp"
#include "risley/calibration/datum.hpp"
#include "risley/calibration/planar_adjustment.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/core/require.hpp"
#include "risley/core/saturating.hpp"
#include "risley/optics/batch.hpp"
#include "risley/trajectories/clock.hpp"

#include "calibration/verdict.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNormalOfMedian = 1.4826;  // sigma of a normal distribution over its MAD
constexpr double kCauchy = 1.5;             // median absolute residuals
constexpr double kGateSigmas = 3;
/// Variance of a normal distribution cut off at the gate.
constexpr double kGatedVariance = 0.97334;
constexpr double kCoarseKnots = 20;     // s
constexpr double kLeastRange = 1e-4;    // smallest sigma that a range is given, m
constexpr double kClockRefresh = 2e-5;  // error of the clock that poses are extrapolated over, s
constexpr double kPoseMargin = 5;       // sigmas of the clock offset
/// Combinations that the flight tells less of than what was known before are named.
constexpr double kUntold = 1;
/// A mean error of the trajectory that keeps this part of its sigma and goes with a boresight angle
/// by this correlation is told as a sum with it only.
constexpr double kKeptSigma = 0.6, kTiedCorrelation = 0.8;
/// Done when a step promises less, in squared sigmas of all unknowns together: shots that come and
/// go at the gate move the answer by about as much.
constexpr double kSettled = 0.1;
/// A drift of the clock counts from so many sigmas on; known before to no better than this, s/s.
constexpr double kDriftSigmas = 5, kDriftPrior = 1e-3;
constexpr std::size_t kDatumBeams = 4000, kFewestCells = 20;

/// What of the globals a round adjusts.
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
constexpr int kAllRounds = 3, kFullRounds = 2;

double flight_seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-9; }

Eigen::Matrix3d rotation_by(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (!(angle > 0)) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

/// The process of a trajectory's errors by the recording's clock.
trajectories::ErrorProcess process_of(const trajectories::ErrorModel& errors,
                                      trajectories::Trajectory local,
                                      const trajectories::Mount& mount) {
  trajectories::require_mount(mount);
  const std::int64_t clock_ns = std::llround(mount.clock_offset.value * 1e9);
  for (std::int64_t& time_ns : local.time_ns) {
    time_ns = saturating_difference(time_ns, clock_ns);
  }
  return {errors, local};
}

/// What sigmas of corrections are in the words of a trajectory.
trajectories::PoseAccuracy accuracy_of(const Eigen::Matrix<double, kCorrections, 1>& sigma,
                                       double heading) {
  const auto of = [&](trajectories::PoseError error) {
    int c = 0;
    while (error_of(c) != error) ++c;
    return sigma[c];
  };
  using trajectories::PoseError;
  const double along = std::cos(heading), across = std::sin(heading);
  const double north = of(PoseError::tilt_north), east = of(PoseError::tilt_east);
  return {{of(PoseError::north), of(PoseError::east), of(PoseError::up)},
          std::hypot(along * north, across * east),
          std::hypot(across * north, along * east),
          of(PoseError::heading)};
}

/// A root of a covariance, [n, n]: its product with its transpose.
MatrixXd root_of(const MatrixXd& covariance) {
  const algebra::PrincipalAxes axes = algebra::principal_axes(covariance);
  return axes.vectors * axes.values.cwiseMax(0).cwiseSqrt().asDiagonal();
}

/// Shots, poses and what they are labelled with.
struct LabelledFlight {
  FlightShots shots;
  ShotPoses poses;
  ShotPoints points;
  GroundCells cells;
};

class FlightWork {
 public:
  FlightWork(const FlightShots& shots, const trajectories::Trajectory& trajectory,
             const FlightCalibrationOptions& options, const Progress& progress)
      : options_(options),
        progress_(progress),
        tangent_(trajectories::tangent_frame(trajectory)),
        local_(trajectories::in_tangent_frame(trajectory, tangent_)),
        interpolation_(local_),
        priors_{.process = process_of(options.errors, local_, options.mount),
                .mean = {},
                .information = {}} {
    require_flight_shots(shots);
    require_options(shots);
    take_shots(shots);
    set_up_model();
  }

  FlightCalibration run() {
    find_coarsely();
    progress_.report(0.4);
    adjust_finely();
    progress_.report(0.9);
    fill_result();
    progress_.report(1);
    return std::move(result_);
  }

 private:
  void require_options(const FlightShots& shots) const {
    require_length("rotation_angle", shots.rotation_angle.size(),
                   static_cast<std::size_t>(options_.sensor.prisms()));
    check_beams(options_.sensor.train, shots.beam, shots.size());
    require_above("range noise", options_.range_noise.value_or(options_.sensor.range_noise), 0,
                  "m");
    require_not_below("sigma of the range offset", options_.range_offset_sigma, 0, "m");
    require_above("prior sigma of angles", options_.angle_sigma, 0, "rad");
    require_not_below("noise of the rotation angles", options_.rotation_angle_sigma, 0, "rad");
    require_above("spacing of the knots", options_.knot_spacing, 0, "s");
    require_at_least("most knots", static_cast<long long>(options_.most_knots), 2);
    require_between("size of a cell", options_.cell_size, 0.1, 100, "m");
    require_threshold("most roughness", options_.most_roughness);
    require_at_least("coarse shots", static_cast<long long>(options_.coarse_shots), 1000);
  }

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
          "all shots are of one strip: at least two that overlap are needed, best crossing ones");
    }
    // Not every n-th one: that would beat with the rotors.
    const double share =
        static_cast<double>(options_.coarse_shots) / static_cast<double>(full_.shots.size());
    if (share >= 1) {
      coarse_.shots = full_.shots;
    } else {
      const RandomStream stream(options_.seed, 1700);
      std::vector<std::size_t> some;
      for (std::size_t i = 0; i < full_.shots.size(); ++i) {
        if (stream.uniform(i) < share) some.push_back(i);
      }
      coarse_.shots = rows_of(full_.shots, some);
    }
  }

  void set_up_model();
  void set_priors();
  void hold(Unlocked unlocked);

  double stated_range_variance() const {
    const double noise = options_.range_noise.value_or(options_.sensor.range_noise);
    const double rounding = options_.sensor.range_resolution / std::sqrt(12.0);
    return noise * noise + rounding * rounding;
  }

  FlightWeights weights() const {
    FlightWeights weights;
    weights.range_variance = range_variance_;
    weights.rotation_angle_variance = options_.rotation_angle_sigma * options_.rotation_angle_sigma;
    if (priors_.process.sample_interval() == 0) return weights;
    weights.sample_interval = priors_.process.sample_interval();
    for (int c = 0; c < kCorrections; ++c) {
      weights.white[static_cast<std::size_t>(c)] =
          priors_.process.white()[static_cast<Index>(error_of(c))];
    }
    return weights;
  }

  void set_knots(const FlightShots& shots, double spacing) {
    const TrajectoryKnots knots = make_knots(shots, spacing);
    model_.corrections = model_.knots.size() == 0
                             ? MatrixXd::Zero(kCorrections, static_cast<Index>(knots.size()))
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
    if (flight.cells.planes.size() < kFewestCells) {
      throw EstimationError(fmt::format(
          "only {} cells of {:g} m of ground were seen by several strips, at least {} are needed: "
          "do the strips overlap, and are mount and trajectory of this flight?",
          flight.cells.planes.size(), size, kFewestCells));
    }
    model_.planes = flight.cells.planes;
  }

  FlightAdjustment adjust(const LabelledFlight& flight, const FlightWeights& weights, int steps) {
    progress_.check();
    FlightAdjustmentOptions options;
    options.most_steps = steps;
    options.tolerance = kSettled;
    FlightAdjustment adjusted = adjust_flight(flight.shots, flight.poses, flight.cells.plane,
                                              model_, weights, priors_, options);
    model_ = std::move(adjusted.model);
    const VectorXd values = unknown_values(model_);
    if (values.head<3>().norm() > 1 || model_.lever_arm.norm() > 100 ||
        std::abs(model_.clock_offset - options_.mount.clock_offset.value) >
            std::max(1e-3, kPoseMargin * options_.mount.clock_offset.sigma)) {
      throw EstimationError(
          "the adjustment ran away: boresight, lever arm or clock offset are far from what the "
          "mount "
          "states; are the axes of the mount right, and the times of sensor and trajectory?");
    }
    return adjusted;
  }

  void find_coarsely() {
    range_variance_ = stated_range_variance();
    set_knots(coarse_.shots, kCoarseKnots);
    pairs_at_start();
    double done = 0;
    const auto round = [&](double cell, Unlocked unlocked, int steps, bool rough_too) {
      hold(unlocked);
      label(coarse_, cell, rough_too);
      const double scatter = std::max(coarse_.cells.scatter, std::sqrt(stated_range_variance()));
      range_variance_ = scatter * scatter;
      FlightWeights own = weights();
      own.cauchy_scale = kCauchy / kNormalOfMedian * scatter;
      adjust(coarse_, own, steps);
      progress_.report(done += 0.035);
    };
    for (const CoarseRound& own : kCellRounds) round(own.cell, own.unlocked, own.steps, true);
    for (int i = 0; i < kAllRounds; ++i) {
      round(options_.cell_size, Unlocked::all, 2, i == 0);
    }
  }

  /// How far strips are apart with what was given.
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

  /// What a piece of the flight adds to what the residuals say of the ranges' noise.
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
    double spacing = options_.knot_spacing, flown = 0;
    for (const auto& interval : model_.knots.intervals) {
      flown += flight_seconds(interval.end_ns - interval.begin_ns);
    }
    const double room = std::max(
        1.0, static_cast<double>(options_.most_knots) - static_cast<double>(full_.shots.strips()));
    if (flown / room > spacing) {
      spacing = flown / room;
      result_.warnings.push_back(fmt::format(
          "corrections of the trajectory have knots every {:.2f} s instead of {:g}, since {:.0f} s "
          "of "
          "flight would need more than {} of them; sigmas consider what happens between",
          spacing, options_.knot_spacing, flown, options_.most_knots));
    }
    // The trajectory first, with shots that are enough for it.
    set_knots(coarse_.shots, spacing);
    label(coarse_, options_.cell_size, false);
    const double scatter = std::max(coarse_.cells.scatter, std::sqrt(stated_range_variance()));
    range_variance_ = stated_range_variance();
    FlightWeights first = weights();
    first.cauchy_scale = 2 * kCauchy / kNormalOfMedian * scatter;
    adjust(coarse_, first, 2);
    progress_.report(0.5);
    set_knots(full_.shots, spacing);
    // Then everything. What the residuals say of the ranges' noise counts in the last round.
    double cell_noise = coarse_.cells.scatter;
    for (int round = 0; round < kFullRounds; ++round) {
      label(full_, options_.cell_size, false, cell_noise);
      cell_noise = full_.cells.scatter;
      FlightWeights own = weights();
      own.gate = kGateSigmas;
      last_ = adjust(full_, own, round + 1 < kFullRounds ? 2 : 4);
      progress_.report(0.5 + 0.2 * (round + 1));
      final_weights_ = own;
      if (round + 1 < kFullRounds) update_range_variance();
    }
  }

  void update_range_variance() {
    FlightWeights own = weights();
    own.gate = kGateSigmas;
    double squares = 0, count = 0;
    for (const PieceScatter& piece : scatter_of(full_, own)) {
      squares += piece.squares;
      count += static_cast<double>(piece.count);
    }
    const double unknowns = 3 * static_cast<double>(model_.planes.size());
    if (count <= unknowns) return;
    range_variance_ = std::max(range_variance_ * squares / (count - unknowns) / kGatedVariance,
                               kLeastRange * kLeastRange);
  }

  void fill_result();
  void fill_unknowns(const FlightSystem& system);
  void take_off_spurious_information(const FlightSystem& system, MatrixXd& all);
  void test_clock_drift();
  void fill_datum(const MatrixXd& movement);
  void fill_not_told(const MatrixXd& functionals);
  void fill_trajectory();

  const FlightCalibrationOptions& options_;
  const Progress& progress_;
  trajectories::TangentFrame tangent_;
  trajectories::Trajectory local_;
  trajectories::Interpolation interpolation_;
  LabelledFlight full_, coarse_;
  FlightModel model_;
  FlightPriors priors_;
  VectorXd prior_sigma_;        // [globals]
  std::size_t considered_ = 0;  // last so many free parameters: held, and may be off
  double range_variance_ = 0;   // m^2
  int grids_ = 0;
  FlightAdjustment last_;
  FlightWeights final_weights_;
  FlightCalibration result_;
};

void FlightWork::set_up_model() {
  const sensors::Sensor& sensor = options_.sensor;
  model_.train = sensor.train;
  model_.geometry = sensor.geometry;
  model_.nominal = options_.mount.nominal;
  Eigen::Vector3d boresight;
  for (Index i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    boresight[i] = options_.mount.boresight[at].value;
    model_.lever_arm[i] = options_.mount.lever_arm[at].value;
  }
  model_.boresight = rotation_by(boresight);
  model_.range_offset = sensor.range_offset;
  model_.clock_offset = options_.mount.clock_offset.value;
  AdjustedParameters adjusted =
      adjusted_parameters(sensor, options_.fixed, options_.additional, std::nullopt);
  model_.free = std::move(adjusted.free);
  for (estimation::FreeParameter& parameter : model_.free) {
    const sensors::Knowledge* known = sensor.find_knowledge(parameter.name);
    if (known != nullptr && known->sigma > 0) {
      parameter.prior_sigma = std::max(known->sigma, known->total_sigma);
    } else if (find_parameter(parameter.name, sensor.shape()).unit == "deg") {
      parameter.prior_sigma = options_.angle_sigma;
    }
  }
  // What is held and may be off is carried along: indices above all. Air and wedges are held by
  // convention, and the index that a recording tells belongs to them; the beam sees them together.
  for (estimation::FreeParameter& held : estimation::uncertain_held(sensor, model_.free)) {
    if (held.name.starts_with("wedge_angle") || held.name == "refractive_index_air") continue;
    model_.free.push_back(std::move(held));
    ++considered_;
  }
  set_priors();
}

void FlightWork::set_priors() {
  const Index globals = model_.unknowns().size();
  priors_.mean = unknown_values(model_);
  prior_sigma_ = VectorXd::Zero(globals);
  for (Index i = 0; i < 3; ++i) {
    prior_sigma_[i] = options_.mount.boresight[static_cast<std::size_t>(i)].sigma;
    prior_sigma_[3 + i] = options_.mount.lever_arm[static_cast<std::size_t>(i)].sigma;
  }
  prior_sigma_[FlightUnknowns::range_offset()] = options_.range_offset_sigma;
  prior_sigma_[FlightUnknowns::clock_offset()] = options_.mount.clock_offset.sigma;
  for (std::size_t j = 0; j < model_.free.size(); ++j) {
    prior_sigma_[FlightUnknowns::parameter(static_cast<int>(j))] = model_.free[j].prior_sigma;
  }
  // A calibration's covariance takes the place of the single sigmas.
  MatrixXd covariance = prior_sigma_.cwiseAbs2().asDiagonal();
  const sensors::Sensor& sensor = options_.sensor;
  require_length("rows of the sensor's covariance",
                 static_cast<std::size_t>(sensor.covariance.rows()),
                 sensor.covariance_names.size());
  require_length("columns of the sensor's covariance",
                 static_cast<std::size_t>(sensor.covariance.cols()),
                 sensor.covariance_names.size());
  const std::vector<std::string> names = unknown_names(model_);
  std::vector<std::pair<Index, Index>> known;  // unknown, its row of the sensor's covariance
  const Index adjusted = globals - static_cast<Index>(considered_);
  for (std::size_t i = 0; i < sensor.covariance_names.size(); ++i) {
    const auto at = std::find(names.begin(), names.end(), sensor.covariance_names[i]);
    if (at != names.end() && at - names.begin() < adjusted) {
      known.emplace_back(at - names.begin(), static_cast<Index>(i));
    }
  }
  for (const auto& [i, row] : known) {
    if (i == FlightUnknowns::range_offset() && options_.range_offset_sigma == 0) continue;
    for (const auto& [j, column] : known) {
      if (j == FlightUnknowns::range_offset() && options_.range_offset_sigma == 0) continue;
      covariance(i, j) = sensor.covariance(row, column);
    }
    prior_sigma_[i] = std::sqrt(covariance(i, i));
  }
  // What has a sigma of 0 is held; any information keeps the matrix regular.
  for (Index i = 0; i < globals; ++i) {
    if (!(prior_sigma_[i] > 0)) covariance(i, i) = 1;
  }
  const algebra::SymmetricSolver solver(covariance);
  if (!solver.positive()) {
    throw InvalidArgument("the covariance of the sensor's parameters is not positive");
  }
  priors_.information = solver.inverse();
}

void FlightWork::hold(Unlocked unlocked) {
  const auto globals = static_cast<std::size_t>(model_.unknowns().size());
  priors_.held.assign(globals, false);
  for (std::size_t i = 0; i < globals; ++i) {
    const auto at = static_cast<int>(i);
    bool held = !(prior_sigma_[at] > 0) || i >= globals - considered_;
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

void FlightWork::fill_result() {
  result_.pairs_after =
      strip_pairs(georeferenced(full_.shots, full_.poses, model_), full_.shots.strip,
                  full_.cells.plane, model_.planes, kGateSigmas * std::sqrt(range_variance_));
  result_.rms_after = rms_of(result_.pairs_after);
  result_.used = last_.shots - last_.outliers - last_.lost;
  result_.outliers = last_.outliers + last_.lost;
  result_.cells = full_.cells.planes.size();
  result_.rough_cells = full_.cells.rough;
  result_.range_sigma = std::sqrt(range_variance_);
  result_.sigma0 = std::sqrt(range_variance_ / stated_range_variance());
  for (const PieceScatter& piece : scatter_of(full_, final_weights_)) {
    if (piece.count == 0) continue;
    result_.piece_time.push_back(piece.time);
    result_.piece_rms.push_back(std::sqrt(piece.metres2 / static_cast<double>(piece.count)));
  }
  const FlightEquations equations =
      flight_equations(full_.shots, full_.poses, full_.cells.plane, model_, final_weights_);
  const FlightSystem system(equations, model_, priors_);
  progress_.report(0.93);
  fill_unknowns(system);
  test_clock_drift();
  fill_trajectory();
  result_.tangent = tangent_;
  result_.converged = last_.converged && result_.reason.empty();
  if (!last_.converged && result_.reason.empty()) {
    result_.reason = fmt::format(
        "the adjustment had not settled: its last step still promised {:.2g} squared sigmas",
        last_.promised);
  }
  result_.model = std::move(model_);
  result_.verdict = verdict_of(result_);
}

void FlightWork::fill_unknowns(const FlightSystem& system) {
  const Index globals = system.globals(), size = system.size();
  const Index knots = (size - globals) / kCorrections;
  MatrixXd functionals = MatrixXd::Zero(size, globals + kCorrections);
  functionals.bottomLeftCorner(globals, globals).setIdentity();
  for (Index k = 0; k < knots; ++k) {
    functionals.block(kCorrections * k, globals, kCorrections, kCorrections) =
        MatrixXd::Identity(kCorrections, kCorrections) / static_cast<double>(knots);
  }
  MatrixXd all = flight_covariance(full_.shots, full_.poses, full_.cells.plane, model_,
                                   final_weights_, priors_, system, functionals);
  take_off_spurious_information(system, all);
  fill_not_told(all);
  // What was held and may be off, one sigma each, moves everything else along.
  const MatrixXd changes = system.held_changes();
  MatrixXd movement = MatrixXd::Zero(globals, globals + static_cast<Index>(considered_));
  movement.leftCols(globals) = root_of(all.topLeftCorner(globals, globals));
  Index column = 0, of_considered = globals;
  for (Index i = 0; i < globals; ++i) {
    if (!priors_.held[static_cast<std::size_t>(i)]) continue;
    if (i >= globals - static_cast<Index>(considered_)) {
      movement.col(of_considered) = prior_sigma_[i] * changes.col(column).tail(globals);
      movement(i, of_considered++) = prior_sigma_[i];
    }
    ++column;
  }
  fill_datum(movement);
  const MatrixXd rates = value_rates(model_);
  result_.covariance = rates * movement * movement.transpose() * rates.transpose();
  const VectorXd diagonal = system.inverse_diagonal();
  result_.correction_sigma = Eigen::Map<const MatrixXd>(diagonal.data(), kCorrections, knots);
  result_.correction_sigma = result_.correction_sigma.cwiseSqrt().eval();

  const std::vector<std::string> names = unknown_names(model_);
  const VectorXd values = unknown_values(model_);
  for (Index i = 0; i < globals; ++i) {
    const auto at = static_cast<std::size_t>(i);
    FlightUnknown& own = result_.unknowns.emplace_back();
    own.name = names[at];
    own.start = priors_.mean[i];
    own.value = values[i];
    own.sigma = std::sqrt(result_.covariance(i, i));
    own.prior_sigma = prior_sigma_[i];
    own.held = priors_.held[at];
    if (own.held) continue;
    own.prior_share = std::min(1.0, std::pow(own.sigma / own.prior_sigma, 2));
    for (Index j = 0; j < globals; ++j) {
      if (j == i || priors_.held[static_cast<std::size_t>(j)]) continue;
      const double correlation =
          result_.covariance(i, j) / std::sqrt(result_.covariance(i, i) * result_.covariance(j, j));
      if (std::abs(correlation) > std::abs(own.twin_correlation)) {
        own.twin_correlation = correlation;
        own.twin = names[static_cast<std::size_t>(j)];
      }
    }
  }
  // Mount and sensor with what was found.
  result_.mount = options_.mount;
  const auto found = [&](trajectories::StatedValue& stated, Index i) {
    if (priors_.held[static_cast<std::size_t>(i)]) return;
    stated = {values[i], std::sqrt(result_.covariance(i, i)), "calibrated in flight by risley"};
  };
  for (Index i = 0; i < 3; ++i) {
    found(result_.mount.boresight[static_cast<std::size_t>(i)], i);
    found(result_.mount.lever_arm[static_cast<std::size_t>(i)], 3 + i);
  }
  found(result_.mount.clock_offset, FlightUnknowns::clock_offset());
  sensors::Sensor& sensor = result_.sensor;
  sensor = options_.sensor;
  sensor.train = model_.train;
  sensor.range_offset = model_.range_offset;
  sensor.reference = sensors::CalibrationReference::planes;
  sensor.provenance.clear();
  sensor.covariance_names.clear();
  std::vector<Index> kept;
  for (Index i = FlightUnknowns::range_offset(); i < globals; ++i) {
    const bool adjusted = !priors_.held[static_cast<std::size_t>(i)];
    if (i == FlightUnknowns::clock_offset() ||
        (!adjusted && i < globals - static_cast<Index>(considered_))) {
      continue;
    }
    kept.push_back(i);
    const std::string& name = names[static_cast<std::size_t>(i)];
    sensor.covariance_names.push_back(name);
    if (adjusted) {
      sensor.set_knowledge({name, std::sqrt(result_.covariance(i, i)),
                            "calibrated in flight by risley calibrate", 0});
    }
  }
  const auto count = static_cast<Index>(kept.size());
  sensor.covariance.resize(count, count);
  for (Index i = 0; i < count; ++i) {
    for (Index j = 0; j < count; ++j) {
      sensor.covariance(i, j) =
          result_.covariance(kept[static_cast<std::size_t>(i)], kept[static_cast<std::size_t>(j)]);
    }
  }
}

/// Planes' normals are off by the noise of the shots that they were found with, and a cell that
/// leans by chance seems to tell of shifts across it, yaw above all. Its shots do not follow: the
/// information is none. How much there is of it is seen where normals are moved by as much again.
void FlightWork::take_off_spurious_information(const FlightSystem& system, MatrixXd& all) {
  FlightModel moved = model_;
  const MatrixXd tilts = system.draw_tilts(options_.seed);
  for (std::size_t i = 0; i < moved.planes.size(); ++i) {
    GroundPlane& plane = moved.planes[i];
    const auto own = tilts.col(static_cast<Index>(i));
    const auto [first, second] =
        tangents_of({plane.normal.x(), plane.normal.y(), plane.normal.z()});
    plane.normal = (plane.normal + own[0] * Eigen::Vector3d(first.x, first.y, first.z) +
                    own[1] * Eigen::Vector3d(second.x, second.y, second.z))
                       .normalized();
  }
  const auto inverse_of = [](const FlightSystem& own) {
    MatrixXd unit = MatrixXd::Zero(own.size(), own.globals());
    unit.bottomRows(own.globals()).setIdentity();
    return MatrixXd(own.solve(unit).bottomRows(own.globals()));
  };
  const MatrixXd before = inverse_of(system);
  const MatrixXd after = inverse_of(FlightSystem(
      flight_equations(full_.shots, full_.poses, full_.cells.plane, moved, final_weights_), moved,
      priors_));
  std::vector<Index> adjusted;
  for (Index i = 0; i < before.rows(); ++i) {
    if (!priors_.held[static_cast<std::size_t>(i)]) adjusted.push_back(i);
  }
  // In units of the priors' sigmas.
  const VectorXd unit = prior_sigma_(adjusted);
  const auto information_of = [&](const MatrixXd& covariance) {
    return MatrixXd(unit.asDiagonal() *
                    algebra::SymmetricSolver(covariance(adjusted, adjusted)).inverse() *
                    unit.asDiagonal());
  };
  // Of what is above 0; twice, since what the trajectory does to a cell makes it lean, too.
  const MatrixXd spurious = root_of(2 * (information_of(after) - information_of(before)));
  const MatrixXd prior =
      unit.asDiagonal() * MatrixXd(priors_.information(adjusted, adjusted)) * unit.asDiagonal();
  const MatrixXd data = root_of(information_of(all) - prior - spurious * spurious.transpose());
  const MatrixXd covariance = unit.asDiagonal() *
                              algebra::SymmetricSolver(prior + data * data.transpose()).inverse() *
                              unit.asDiagonal();
  for (std::size_t i = 0; i < adjusted.size(); ++i) {
    for (std::size_t j = 0; j < adjusted.size(); ++j) {
      all(adjusted[i], adjusted[j]) = covariance(static_cast<Index>(i), static_cast<Index>(j));
    }
  }
}

/// What one more step would do if the clock could drift, and how well that is known.
void FlightWork::test_clock_drift() {
  const std::vector<std::int64_t>& times = full_.shots.time_ns;
  FlightModel drifting = model_;
  drifting.drift_about_ns = times.front() + (times.back() - times.front()) / 2;
  const Index drift = drifting.unknowns().clock_drift();
  FlightPriors priors = priors_;
  priors.mean.conservativeResizeLike(VectorXd::Zero(drift + 1));
  priors.information.conservativeResizeLike(MatrixXd::Zero(drift + 1, drift + 1));
  priors.information(drift, drift) = 1 / (kDriftPrior * kDriftPrior);
  priors.held.push_back(false);
  const FlightSystem system(
      flight_equations(full_.shots, full_.poses, full_.cells.plane, drifting, final_weights_),
      drifting, priors);
  MatrixXd functional = MatrixXd::Zero(system.size(), 1);
  functional(system.size() - 1, 0) = 1;
  ClockDrift& found = result_.clock_drift;
  found.value = system.step().unknowns[system.size() - 1];
  found.sigma = std::sqrt(flight_covariance(full_.shots, full_.poses, full_.cells.plane, drifting,
                                            final_weights_, priors, system, functional)(0, 0));
  found.seconds = flight_seconds(times.back() - times.front());
  found.significant = std::abs(found.value) > kDriftSigmas * found.sigma;
  if (!found.significant) return;
  result_.warnings.push_back(fmt::format(
      "the clocks of sensor and trajectory drift apart: the trajectory's gains {:.2g} +- {:.1g} "
      "ppm "
      "on the recording's, {:.2g} ms over the {:.0f} s between the first shot and the last; an "
      "offset of the clock cannot hold that, and what was found is off by more than its sigmas. "
      "Set "
      "the sensor's clock by PPS or PTP, or calibrate shorter parts of the flight",
      1e6 * found.value, 1e6 * found.sigma, 1e3 * found.value * found.seconds, found.seconds));
}

void FlightWork::fill_datum(const MatrixXd& movement) {
  const FlightShots& shots = coarse_.shots;
  const std::vector<std::size_t> rows = spread_rows(shots.size(), kDatumBeams);
  std::vector<std::vector<double>> angles(shots.rotation_angle.size());
  std::vector<std::uint8_t> beam;
  std::vector<double> ranges;
  for (const std::size_t row : rows) {
    for (std::size_t k = 0; k < angles.size(); ++k) {
      angles[k].push_back(shots.rotation_angle[k][row]);
    }
    if (!shots.beam.empty()) beam.push_back(shots.beam[row]);
    ranges.push_back(shots.range[row]);
  }
  HeldMovement bundle;
  bundle.train =
      MatrixXd::Zero(static_cast<Index>(model_.train.parameters().size()), movement.cols());
  bundle.rotation_angles = MatrixXd::Zero(model_.train.prisms(), movement.cols());
  bundle.turn = movement.topRows<3>();
  for (std::size_t j = 0; j < model_.free.size(); ++j) {
    for (const int at : model_.free[j].places) {
      bundle.train.row(at) = movement.row(FlightUnknowns::parameter(static_cast<int>(j)));
    }
  }
  const FormalDatum formal =
      formal_datum(model_.train, {}, MatrixXd::Zero(0, 0), angles, beam, bundle);
  FlightDatum& datum = result_.datum;
  datum.sigma_x = formal.sigma_roll;
  datum.sigma_y = formal.sigma_pitch;
  datum.sigma_z = formal.sigma_yaw;
  datum.rotation = formal.gauge;
  datum.shape = formal.shape;
  datum.total = std::hypot(formal.gauge, formal.shape);
  const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
  std::nth_element(ranges.begin(), middle, ranges.end());
  datum.height = *middle;
}

void FlightWork::fill_not_told(const MatrixXd& all) {
  const Index globals = model_.unknowns().size();
  const std::vector<std::string> names = unknown_names(model_);
  std::vector<Index> adjusted;
  std::vector<estimation::FreeParameter> unknowns;
  for (Index i = 0; i < globals; ++i) {
    if (priors_.held[static_cast<std::size_t>(i)]) continue;
    adjusted.push_back(i);
    unknowns.push_back({names[static_cast<std::size_t>(i)], {}, prior_sigma_[i]});
  }
  const auto count = static_cast<Index>(adjusted.size());
  MatrixXd covariance(count, count), prior(count, count);
  for (Index i = 0; i < count; ++i) {
    for (Index j = 0; j < count; ++j) {
      const Index row = adjusted[static_cast<std::size_t>(i)],
                  column = adjusted[static_cast<std::size_t>(j)];
      covariance(i, j) = all(row, column);
      prior(i, j) = priors_.information(row, column);
    }
  }
  // Of the flight alone.
  const MatrixXd information = algebra::SymmetricSolver(covariance).inverse() - prior;
  for (const auto& weak : estimation::weak_directions(information, unknowns, kUntold)) {
    result_.not_told.push_back(
        {estimation::direction_text(weak), weak.sigma / std::hypot(1.0, weak.sigma)});
  }
  // Errors of the trajectory that stay as they are all flight long look like a boresight.
  constexpr const char* kMeans[] = {"tilts about east", "tilts about north", "heading"};
  const TrajectoryKnots& knots = model_.knots;
  for (Index c = 3; c < kCorrections; ++c) {
    const auto row = static_cast<Index>(error_of(static_cast<int>(c)));
    const double time = priors_.process.correlation_times()[row];
    std::vector<double> sigmas;
    for (const std::int64_t one : knots.time_ns) {
      sigmas.push_back(priors_.process.sigmas(one)[row]);
    }
    double before = 0;
    for (std::size_t i = 0; i < knots.size(); ++i) {
      for (std::size_t j = 0; j < knots.size(); ++j) {
        before += sigmas[i] * sigmas[j] *
                  std::exp(-std::abs(flight_seconds(knots.time_ns[i] - knots.time_ns[j])) / time);
      }
    }
    if (!(before > 0)) continue;
    const double sigma_before = std::sqrt(before) / static_cast<double>(knots.size());
    const double variance = all(globals + c, globals + c);
    const double kept = std::sqrt(variance) / sigma_before;
    if (kept < kKeptSigma) continue;
    for (Index i = 0; i < 3; ++i) {
      if (priors_.held[static_cast<std::size_t>(i)]) continue;
      const double correlation = all(i, globals + c) / std::sqrt(all(i, i) * variance);
      if (std::abs(correlation) < kTiedCorrelation) continue;
      result_.not_told.push_back({fmt::format("{} against the {} of the trajectory",
                                              names[static_cast<std::size_t>(i)], kMeans[c - 3]),
                                  kept});
    }
  }
}

void FlightWork::fill_trajectory() {
  trajectories::Trajectory corrected = local_;
  corrected.accuracy.resize(corrected.size());
  const auto clock_ns = static_cast<std::int64_t>(std::llround(model_.clock_offset * 1e9));
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    const Eigen::Matrix<double, kCorrections, 1> error = correction_at(
        model_.knots, model_.corrections, priors_.process, corrected.time_ns[i] - clock_ns);
    corrected.position[i] += error.head<3>();
    corrected.attitude[i] =
        (Eigen::Quaterniond(rotation_by(error.tail<3>())) * corrected.attitude[i]).normalized();
    corrected.accuracy[i] =
        accuracy_of(correction_sigma_at(model_.knots, result_.correction_sigma, priors_.process,
                                        corrected.time_ns[i] - clock_ns),
                    trajectories::roll_pitch_heading(corrected.frame, corrected.position[i],
                                                     corrected.attitude[i])
                        .heading);
  }
  result_.trajectory = trajectories::from_tangent_frame(corrected, tangent_);
}

}  // namespace

FlightCalibration calibrate_flight(const FlightShots& shots,
                                   const trajectories::Trajectory& trajectory,
                                   const FlightCalibrationOptions& options,
                                   const Progress& progress) {
  return FlightWork(shots, trajectory, options, progress).run();
}

}  // namespace risley::calibration
