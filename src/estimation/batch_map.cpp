// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/batch_map.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/estimation/frame_turn.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/estimation/process_likelihood.hpp"
#include "risley/estimation/rotor_track.hpp"
#include "risley/estimation/smoother.hpp"
#include "risley/parallel/parallel.hpp"

#include "estimation/entry_checks.hpp"
#include "estimation/knot_model.hpp"
#include "estimation/normal_equations_kernel.hpp"

namespace risley::estimation {
namespace {

constexpr double kCoarseRate = 1000.0;  // Hz
/// Short recordings are thinned less: the coarse pass must know the parameters too.
constexpr double kFewestCoarseShots = 10000.0;
/// A step is small when it moves no parameter by more than this share of its sigma: the remainder
/// is of second order.
constexpr double kSmallStep = 0.1;
constexpr int kMostFullPasses = 8;
/// If there are more than this many shots to one of the coarse pass, a step with this share of them
/// is inserted: near the optical axis angles are far from linear in quantities that the coarse pass
/// does not determine, and a further pass over all shots would cost more.
constexpr double kStrongThinning = 16.0, kSomeShots = 0.25;
/// Residuals are correlated if that multiplies variances by more than the second; rotors that are
/// free to follow explain it if they leave at most the first of the factor.
constexpr double kWhitened = 0.75, kNearlyWhite = 1.2;
/// Residual scatter above the stated one by this share enlarges the covariance.
constexpr double kSignificantExcess = 1.02;

/// The constants of an estimation: the free parameters, then the frame's turn if that is free.
struct Constants {
  std::vector<FreeParameter> parameters, all;

  Constants(const BatchMapOptions& options, const TrainLayout& layout)
      : parameters(options.free), all(options.free) {
    if (!(options.frame_sigma > 0)) return;
    const auto frame = frame_parameters(layout, options.frame_sigma);
    all.insert(all.end(), frame.begin(), frame.end());
  }
  bool frame_is_free() const { return all.size() > parameters.size(); }
  Eigen::Index count() const { return static_cast<Eigen::Index>(parameters.size()); }
};

/// Residuals of some shots of a series: NaN, and outliers, until they are set.
class ResidualSample {
 public:
  /// @param ranges  rows of the series, ascending
  ResidualSample(const PackedSeries& series, std::vector<ShotRange> ranges)
      : ranges_(std::move(ranges)) {
    for (const ShotRange& range : ranges_) {
      begin_.push_back(shots.size());
      for (std::size_t row = range.begin; row < range.end; ++row) {
        shots.append(series.time_ns(row), 0, 0);
      }
    }
    azimuth.assign(shots.size(), std::numeric_limits<double>::quiet_NaN());
    zenith = azimuth;
    outlier.assign(shots.size(), 1);
  }

  /// Copies those of its shots that were evaluated; different ones from several threads.
  void take(const EvaluatedShots& all) {
    const std::size_t end = all.first + all.shots.size();
    auto range = std::partition_point(ranges_.begin(), ranges_.end(),
                                      [&](const ShotRange& one) { return one.end <= all.first; });
    for (; range != ranges_.end() && range->begin < end; ++range) {
      const std::size_t first = begin_[static_cast<std::size_t>(range - ranges_.begin())];
      for (std::size_t row = std::max(range->begin, all.first); row < std::min(range->end, end);
           ++row) {
        const std::size_t from = row - all.first, to = first + row - range->begin;
        azimuth[to] = all.azimuth_residual[from];
        zenith[to] = all.zenith_residual[from];
        outlier[to] = all.outlier[from];
        shots.azimuth_rounding_variance[to] = all.shots.azimuth_rounding_variance[from];
        shots.zenith_rounding_variance[to] = all.shots.zenith_rounding_variance[from];
      }
    }
  }

  AngleSeries shots;  ///< times and roundings alone
  std::vector<double> azimuth, zenith;
  std::vector<unsigned char> outlier;

 private:
  std::vector<ShotRange> ranges_;
  std::vector<std::size_t> begin_;  ///< of the ranges, among the sampled shots
};

/// Every n-th row, as ranges of one.
std::vector<ShotRange> every_nth_row(std::size_t rows, std::size_t stride) {
  std::vector<ShotRange> ranges;
  for (std::size_t row = 0; row < rows; row += stride) ranges.push_back({row, row + 1});
  return ranges;
}

/// Parameters and motion, and the result of one evaluation.
class Iteration {
 public:
  Iteration(const PackedSeries& series, const BatchMapOptions& options, const Constants& constants,
            const PrismTrain& nominal, PrismTrain train, RotorTrajectory knots,
            const Eigen::Matrix3d& frame)
      : series_(series),
        constants_(constants),
        noise_is_held_(options.angle_noise.has_value()),
        prior_mean_(free_values(nominal, options.free)),
        train_(std::move(train)),
        knots_(std::move(knots)),
        frame_(frame),
        spread_(series,
                every_nth_row(series.size(),
                              robust_stride(series.size(), noise_is_held_ ? kRobustLevelShots
                                                                          : kRobustNoiseShots))),
        outlier_(series.size(), 1) {}

  ShotWeights& weights() { return weights_; }
  const ShotWeights& weights() const { return weights_; }
  const PrismTrain& train() const { return train_; }
  const Eigen::Matrix3d& frame() const { return frame_; }
  const RotorTrajectory& knots() const { return knots_; }
  RotorTrajectory& knots() { return knots_; }
  NormalEquations& equations() { return equations_; }
  std::vector<unsigned char>& outlier() { return outlier_; }
  const SquaredAngles& squares() const { return squares_; }
  /// From here on evaluations also compute an autocorrelation.
  void watch_autocorrelation() {
    windows_.emplace(series_, autocorrelation_windows(series_.size()));
  }
  Autocorrelation autocorrelation() const {
    return estimation::autocorrelation(windows_->shots.time_ns, windows_->azimuth, windows_->zenith,
                                       windows_->outlier);
  }

  /// Normal equations at the current state, and statistics of the residuals there.
  void evaluate() {
    squares_ = {};
    ShotLooks looks;
    if (constants_.frame_is_free()) {
      looks.prepare = [&](AngleSeries& rows) { turn(rows, frame_.transpose()); };
    }
    looks.look = [&](const EvaluatedShots& shots) -> std::function<void()> {
      spread_.take(shots);
      if (windows_) windows_->take(shots);
      std::copy(shots.outlier.begin(), shots.outlier.end(),
                outlier_.begin() + static_cast<std::ptrdiff_t>(shots.first));
      const auto squares = std::make_shared<SquaredAngles>();
      squares->add(shots.shots, shots.azimuth_residual, shots.zenith_residual, shots.outlier);
      return [this, squares] { squares_.add(*squares); };
    };
    accumulate(series_, knots_, train_, constants_.all, weights_, equations_, looks);
  }

  /// Residual scale over noise and rounding; outliers are excluded. Held noise is not below its
  /// stated value; otherwise noise follows from the residuals, and the scale is then 1.
  double level() {
    if (!noise_is_held_) {
      weights_.angle_noise = robust_noise(spread_.shots, spread_.azimuth, spread_.zenith);
      return 1.0;
    }
    return std::max(
        1.0, robust_level(spread_.shots, weights_.angle_noise, spread_.azimuth, spread_.zenith));
  }

  SmootherSolution solve(std::span<const RotorProcess> process, bool covariances) const {
    ParameterPrior prior;
    const auto n = static_cast<Eigen::Index>(constants_.all.size());
    prior.information.resize(n);
    Eigen::VectorXd offset = Eigen::VectorXd::Zero(n);
    offset.head(constants_.count()) = prior_mean_ - free_values(train_, constants_.parameters);
    if (constants_.frame_is_free()) {
      const FrameTurn turn = turn_of(frame_, train_.layout().axis_up);
      offset.tail(2) = -Eigen::Vector2d(turn.yaw, turn.pitch);
    }
    for (Eigen::Index i = 0; i < n; ++i) {
      const double sigma = constants_.all[static_cast<std::size_t>(i)].prior_sigma;
      prior.information[i] = 1.0 / (sigma * sigma);
    }
    prior.gradient = prior.information.cwiseProduct(offset);
    return smooth(equations_, knots_, process, prior, covariances);
  }

  /// Takes a step. @return its largest share of a constant's sigma, or root mean square share of
  /// the angles' sigmas (of the noise of a shot if those were not computed)
  double move(const SmootherSolution& solution) {
    const Eigen::VectorXd step = solution.parameter_step.head(constants_.count());
    train_ = with_free_values(train_, constants_.parameters,
                              free_values(train_, constants_.parameters) + step);
    if (constants_.frame_is_free()) {
      frame_ = turned_further(frame_, solution.parameter_step.tail(2), train_.layout().axis_up);
    }
    double largest = 0;
    for (Eigen::Index i = 0; i < solution.parameter_step.size(); ++i) {
      largest = std::max(largest, std::abs(solution.parameter_step[i]) /
                                      std::sqrt(solution.parameter_covariance(i, i)));
    }
    const auto d = static_cast<std::size_t>(knots_.states());
    const std::size_t triangle = d * (d + 1) / 2;
    const double noise = weights_.angle_noise.rms();
    double squares = 0, variances = 0;
    for (std::size_t i = 0; i < knots_.state.size(); ++i) {
      knots_.state[i] += solution.state_step[i];
      if (i % kStatesPerRotor != 0) continue;
      squares += solution.state_step[i] * solution.state_step[i];
      const std::size_t row = i % d;
      variances +=
          solution.state_covariance.empty()
              ? noise * noise
              : solution.state_covariance[i / d * triangle + row * d - row * (row - 1) / 2];
    }
    return std::max(largest, std::sqrt(squares / variances));
  }

 private:
  const PackedSeries& series_;
  const Constants& constants_;
  bool noise_is_held_;
  Eigen::VectorXd prior_mean_;
  PrismTrain train_;
  RotorTrajectory knots_;
  Eigen::Matrix3d frame_;
  ShotWeights weights_;
  NormalEquations equations_;
  ResidualSample spread_;
  std::optional<ResidualSample> windows_;
  std::vector<unsigned char> outlier_;
  SquaredAngles squares_;
};

/// Starts of all stretches of a thinned series; an empty one if none was found.
struct StretchStart {
  ShotRange shots;
  std::optional<Start> start;
};

/// @param ranges  the stretches of the series
std::vector<StretchStart> find_stretch_starts(const AngleSeries& series,
                                              const std::vector<ShotRange>& ranges,
                                              const Start& first, const sensors::Sensor& sensor,
                                              double angle_noise) {
  std::vector<StretchStart> result;
  sensors::Sensor known = sensor;
  known.train = first.train;
  bool first_found = false;
  for (const ShotRange& shots : ranges) {
    result.push_back({shots, std::nullopt});
    if (!first_found && first.time_ns >= series.time_ns[shots.begin] &&
        first.time_ns <= series.time_ns[shots.end - 1]) {
      first_found = true;
      result.back().start = first;
      continue;
    }
    try {
      constexpr std::size_t kHead = 2000;
      const AngleSeries head =
          rows_of(series, shots.begin, std::min(shots.end, shots.begin + kHead));
      Start start = find_start(head, known, {{}, angle_noise, false, false});
      if (start.combination == first.combination) result.back().start = std::move(start);
    } catch (const EstimationError&) {  // too short or too empty: its shots stay unused
    }
  }
  return result;
}

/// Number of observed angles used up by the estimate itself: the trace of curvature times
/// covariance, states and constants together.
double used_observations(const NormalEquations& equations, const SmootherSolution& solution) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto n = static_cast<Eigen::Index>(equations.free);
  const Eigen::Index states = kStatesPerRotor * equations.prisms;
  double used = equations.static_hessian.cwiseProduct(solution.parameter_covariance).sum();
  const double* entry = solution.state_covariance.data();
  // Sum over the knots of coupling^T sensitivity.
  Eigen::MatrixXd shared = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t knot = 0; knot < equations.knots(); ++knot) {
    const auto curvature = knot_curvature<Eigen::Dynamic>(equations, knot);
    for (Eigen::Index i = 0; i < states; ++i) {
      for (Eigen::Index j = i; j < states; ++j) {
        used += (i == j ? 1.0 : 2.0) * curvature(i, j) * *entry++;
      }
    }
    if (n == 0) continue;
    const auto at = static_cast<std::size_t>(states * n) * knot;
    const Eigen::Map<const RowMajor> coupling(equations.coupling.data() + at, states, n);
    add_product(coupling.transpose(), solution.sensitivity(knot, states), shared);
  }
  return used + 2.0 * shared.cwiseProduct(solution.parameter_covariance).sum();
}

/// 1 + 2 (rho_1^2 + ...): correlation factor of squared residuals.
double square_factor(const Autocorrelation& autocorrelation) {
  double factor = 1.0;
  for (const double rho : autocorrelation.rho) factor += 2.0 * rho * rho;
  return factor;
}

/// Rate, Hz, of the coarse pass.
double coarse_rate(const PackedSeries& series, const std::vector<ShotRange>& ranges) {
  double duration = 0;
  for (const ShotRange& range : ranges) {
    duration +=
        1e-9 * static_cast<double>(series.time_ns(range.end - 1) - series.time_ns(range.begin));
  }
  return std::max(kCoarseRate, kFewestCoarseShots / std::max(duration, 1e-3));
}

/// Sum over the knots of their shots' information about the angles [prisms, prisms].
Eigen::MatrixXd shared_angle_information(const NormalEquations& equations) {
  const auto prisms = static_cast<Eigen::Index>(equations.prisms);
  const std::size_t pairs = equations.curvature.size() / equations.knots() / kTimePowers;
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(prisms, prisms);
  for (std::size_t knot = 0; knot < equations.knots(); ++knot) {
    const double* entry = equations.curvature.data() + knot * pairs * kTimePowers;
    for (Eigen::Index k = 0; k < prisms; ++k) {
      for (Eigen::Index l = k; l < prisms; ++l, entry += kTimePowers) sum(k, l) += *entry;
    }
  }
  return sum.selfadjointView<Eigen::Upper>();
}

/// Mean over the knots of d rotation angles / d parameters [prisms, free].
Eigen::MatrixXd mean_angle_sensitivity(const SmootherSolution& solution,
                                       const RotorTrajectory& knots) {
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(knots.prisms, solution.parameter_step.size());
  if (mean.cols() == 0) return mean;  // everything is held
  for (std::size_t knot = 0; knot < knots.size(); ++knot) {
    const auto sensitivity = solution.sensitivity(knot, knots.states());
    for (Eigen::Index k = 0; k < mean.rows(); ++k) {
      mean.row(k) += sensitivity.row(kStatesPerRotor * k);
    }
  }
  return mean / static_cast<double>(knots.size());
}

/// Robust steps from tracked phases, until neither scale nor constants change any more.
/// @param process  of the rotors, chosen on the way if it is not given
/// @return level of the residuals
double settle(Iteration& coarse, const BatchMapOptions& options, std::vector<RotorProcess>& process,
              std::size_t& iterations, const Progress& progress) {
  bool chosen = !options.rotor_process.empty();
  double level = 0, scale = 0, moved = std::numeric_limits<double>::infinity();
  const auto rescale = [&] {
    level = coarse.level();
    coarse.weights().softening = softening_at(level);
    scale = level * coarse.weights().angle_noise.rms();
  };
  for (int i = 0; i < options.most_iterations; ++i) {
    if (i == 0) {  // the weights need a scale first
      coarse.evaluate();
      rescale();
    }
    coarse.evaluate();
    const double before = scale;
    rescale();
    progress.report(0.05 + 0.35 * (i + 1) / options.most_iterations);
    if (moved < kSmallStep && std::abs(scale / before - 1.0) < 0.02) {
      if (chosen) break;
      process = likeliest_process(coarse.equations(), coarse.knots());
      chosen = true;
    }
    moved = coarse.move(coarse.solve(process, false));
    ++iterations;
  }
  return level;
}

/// Passes over all shots until convergence, with noise and covariances.
/// @param level  of the residuals so far
void refine(Iteration& full, const BatchMapOptions& options, const Constants& constants,
            double level, std::vector<RotorProcess>& process, Solution& result,
            const Progress& progress) {
  const bool choose = options.rotor_process.empty();
  full.watch_autocorrelation();
  const bool noise_is_held = options.angle_noise.has_value();
  double used_share = 0, first_factor = 1;
  std::vector<RotorProcess> stiff_process;  // of rotors whose noise is assumed correlated
  for (int pass = 0; pass < kMostFullPasses; ++pass) {
    full.evaluate();
    if (noise_is_held) level = full.level();
    full.weights().cut = options.outlier_chi2 * level * level;
    // The rotors' noise shows more clearly in all shots than in the thinned ones.
    result.autocorrelation = full.autocorrelation();
    const AngleNoise assumed = full.weights().angle_noise;
    bool noise_is_found = true;
    if (noise_is_held) {
      result.noise.value = assumed;
    } else {
      result.noise =
          noise_components(full.squares(), used_share, square_factor(result.autocorrelation));
      full.weights().angle_noise = usable_noise(result.noise.value);
      noise_is_found = std::abs(assumed.rms() / full.weights().angle_noise.rms() - 1.0) < 0.01;
    }
    result.unit_variance = unit_variance(full.squares(), assumed);
    const double excess = result.unit_variance > kSignificantExcess ? result.unit_variance : 1.0;
    const double factor = result.autocorrelation.factor;
    result.variance_factor = factor * excess;
    full.equations().scale(1.0 / excess);
    if (choose && pass == 0) process = likeliest_process(full.equations(), full.knots());
    full.equations().scale(1.0 / factor);
    // Neighbouring residuals are correlated because rotors wander faster than assumed, or because
    // the noise itself is: only in the first case do rotors that follow leave white residuals.
    if (choose && pass == 0 && factor > kNearlyWhite) {
      stiff_process = likeliest_process(full.equations(), full.knots());
      first_factor = factor;
    }
    const bool noise_is_coloured =
        pass == 1 && !stiff_process.empty() && factor > kWhitened * first_factor;
    if (noise_is_coloured) process = stiff_process;
    // The first step goes from the solution of thinned shots to that of all, the second should be
    // one of rounding.
    SmootherSolution solution = full.solve(process, true);
    const std::size_t angles = 2 * (full.equations().shots - full.equations().outliers);
    const double counted_share = std::exchange(
        used_share, std::clamp(used_observations(full.equations(), solution) /
                                   static_cast<double>(std::max<std::size_t>(1, angles)),
                               0.0, 0.9));
    const double moved = full.move(solution);
    ++result.iterations;
    progress.report(0.4 + 0.6 * (pass + 1) / kMostFullPasses);
    // The noise was found with the degrees of freedom of the previous pass; if they differed, a
    // third pass is needed.
    const bool goes_on =
        noise_is_coloured || moved > kSmallStep || !noise_is_found ||
        (pass < 2 && !noise_is_held && std::abs(used_share - counted_share) > 1e-3);
    if (pass == 0 || (goes_on && pass + 1 < kMostFullPasses)) continue;
    result.settled = moved <= kSmallStep;
    const Eigen::Index n = constants.count();
    result.covariance = solution.parameter_covariance.topLeftCorner(n, n);
    if (constants.frame_is_free()) {
      result.frame_covariance = solution.parameter_covariance.bottomRightCorner<2, 2>();
    }
    result.information = std::move(solution.parameter_information);
    full.knots().covariance = std::move(solution.state_covariance);
    result.common_angles = {mean_angle_sensitivity(solution, full.knots()).leftCols(n),
                            shared_angle_information(full.equations())};
    break;
  }
}

}  // namespace

Solution run_batch_map(const PackedSeries& series, const Start& start,
                       const sensors::Sensor& sensor, const BatchMapOptions& options,
                       const Progress& progress) {
  if (series.size() == 0) throw EstimationError("no valid shot to estimate from");
  if (options.angle_noise) check_noise(*options.angle_noise);
  require_between("knot interval", options.knot_interval, 1e-9, kMostSeconds, "s");
  require_not_below("frame sigma", options.frame_sigma, 0, "rad");
  require_threshold("outlier chi2", options.outlier_chi2);
  require_at_least("most iterations", options.most_iterations, 1);
  const int prisms = sensor.prisms();
  require_start(start, prisms);
  require_process(options.rotor_process, prisms);
  const auto rotors = static_cast<std::size_t>(prisms);
  Solution result;
  std::vector<RotorProcess> process = options.rotor_process.empty()
                                          ? std::vector<RotorProcess>(rotors, start.motion.process)
                                          : options.rotor_process;

  // Coarse: tracked phases, then robust steps.
  const Constants constants(options, sensor.train.layout());
  const std::vector<ShotRange> all_stretches = stretches(series);
  std::vector<ShotRange> coarse_stretches = all_stretches;
  const PackedSeries coarse_shots =
      thinned(series, coarse_rate(series, all_stretches), coarse_stretches);
  const AngleSeries coarse_series = coarse_shots.rows();
  const AngleNoise first_noise =
      options.angle_noise.value_or(equal_noise(std::max(start.residual_rms, kLeastAngleNoise)));
  const auto starts =
      find_stretch_starts(coarse_series, coarse_stretches, start, sensor, first_noise.rms());
  std::vector<ShotRange> coarse_used, used;
  for (std::size_t s = 0; s < starts.size(); ++s) {
    if (starts[s].start) {
      coarse_used.push_back(coarse_stretches[s]);
      used.push_back(all_stretches[s]);
    } else {
      result.unused_shots += all_stretches[s].size();
    }
  }
  if (used.empty()) throw EstimationError("no start was found for any stretch of the recording");
  // The shots of the pass between the coarse one and that of all are selected during the coarse
  // one.
  const double thinning =
      static_cast<double>(series.size()) / static_cast<double>(coarse_series.size());
  PackedSeries some;
  std::vector<ShotRange> some_ranges = used;
  parallel::TaskGroup picking;
  if (thinning >= kStrongThinning) {
    picking.run([&, rate = coarse_rate(series, all_stretches) * thinning * kSomeShots] {
      some = thinned(series, rate, some_ranges);
    });
  }
  Iteration coarse(coarse_shots, options, constants, sensor.train, start.train,
                   make_knots(coarse_shots, coarse_used, prisms, options.knot_interval),
                   Eigen::Matrix3d::Identity());
  coarse.weights().angle_noise = first_noise;
  for (std::size_t s = 0, stretch = 0; s < starts.size(); ++s) {
    if (!starts[s].start) continue;
    track_rotors(coarse_series, starts[s].shots, *starts[s].start, first_noise, coarse.knots(),
                 coarse.knots().stretch_begin[stretch], coarse.knots().stretch_end(stretch));
    ++stretch;
  }
  progress.report(0.05);
  double level = settle(coarse, options, process, result.iterations, progress);
  progress.report(0.4);

  // First some of the shots, then all: the same stretches, starting from the result of the previous
  // pass. That one's memory is as much as the next one needs.
  const auto go_on = [&](Iteration from, const PackedSeries& shots,
                         const std::vector<ShotRange>& ranges) {
    Iteration next(shots, options, constants, sensor.train, from.train(),
                   make_knots(shots, ranges, prisms, options.knot_interval), from.frame());
    interpolate(from.knots(), next.knots());
    next.weights().angle_noise = from.weights().angle_noise;
    next.weights().cut = options.outlier_chi2 * level * level;
    return next;
  };
  const auto go_on_with_all = [&] {
    if (thinning < kStrongThinning) return go_on(std::move(coarse), series, used);
    picking.wait();
    Iteration middle = go_on(std::move(coarse), some, some_ranges);
    middle.evaluate();
    level = middle.level();
    middle.move(middle.solve(process, false));
    return go_on(std::move(middle), series, used);
  };
  Iteration full = go_on_with_all();
  some = {};
  refine(full, options, constants, level, process, result, progress);
  result.train = full.train();
  result.frame = full.frame();
  result.constants = constants.all;
  result.parameters = free_values(result.train, options.free);
  result.rotor_process = std::move(process);
  result.trajectory = std::move(full.knots());
  result.outlier = std::move(full.outlier());
  result.outliers = full.equations().outliers;
  progress.report(1.0);
  return result;
}

}  // namespace risley::estimation
