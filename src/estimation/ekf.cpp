// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/ekf.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/golden_section.hpp"
#include "risley/estimation/angle_noise.hpp"
#include "risley/optics/batch.hpp"
#include "risley/optics/observation_model.hpp"

#include "estimation/entry_checks.hpp"
#include "estimation/filter.hpp"

namespace risley::estimation {
namespace {

/// Chi-square of the innovations while the filter settles.
constexpr double kOpenGate = 400.0;
/// Filtered states kept at a time for the combination.
constexpr std::size_t kBlock = 1024;
/// Number of shots used in the search for the process noise.
constexpr std::size_t kLikelihoodShots = 10000;

/// White accelerations from decimal logarithms of (deg/s) / sqrt(s).
std::vector<RotorProcess> processes(const std::vector<double>& decades) {
  std::vector<RotorProcess> result;
  result.reserve(decades.size());
  for (const double d : decades)
    result.push_back({radians_from_degrees(std::pow(10.0, d)), 0.0, 0.0});
  return result;
}

/// Observed minus modelled of a shot, azimuth first, rad; NaN when the beam does not get through.
Eigen::Vector2d residual_of(const AngleSeries& series, std::size_t shot, const PrismTrain& train,
                            std::span<const double> rotation_angles) {
  const auto modelled =
      angles_from_unit_vector(observe(train, rotation_angles, series.beam[shot]).direction);
  return {wrap_to_pi(series.azimuth[shot] - modelled.azimuth),
          series.zenith[shot] - modelled.zenith};
}

/// Shots to exclude although the filter's prior is still wide enough to accept them: those among
/// the first that lie far from the expectation of the start, or of the previous pass.
std::vector<unsigned char> screen(const AngleSeries& series, const Start& start,
                                  const EkfOptions& options, const FilterReference* reference) {
  std::vector<unsigned char> outlier(series.size(), 0);
  const PrismTrain train =
      reference ? with_free_values(start.train, options.free, reference->before.parameters)
                : start.train;
  std::vector<double> angle(static_cast<std::size_t>(train.prisms()));
  const double start_limit = std::max(radians_from_degrees(0.1), 8.0 * start.residual_rms);
  for (std::size_t i = 0; i < std::min(options.gate_after, series.size()); ++i) {
    const double t = 1e-9 * static_cast<double>(series.time_ns[i] - start.time_ns);
    if (!reference && std::abs(t) > start.reach) continue;
    for (std::size_t k = 0; k < angle.size(); ++k) {
      angle[k] = reference ? reference->angles(i)[k]
                           : start.rotation_angle[k] + t * start.angular_velocity[k];
    }
    const double variance = options.angle_noise * options.angle_noise +
                            static_cast<double>(series.azimuth_rounding_variance[i] +
                                                series.zenith_rounding_variance[i]);
    const double limit = reference ? 6.0 * std::sqrt(variance) : start_limit;
    outlier[i] = !(residual_of(series, i, train, angle).norm() < limit);
  }
  return outlier;
}

/// Log likelihood of the innovations over the first shots for a choice of process noise, linearised
/// at a reference so that it is that of a linear filter, whatever the noise.
double likelihood(const AngleSeries& series, const PrismTrain& train, const EkfOptions& options,
                  const std::vector<RotorProcess>& process, const FilterReference& reference) {
  const Filter filter(series, train, options, process, &reference);
  FilterState state = reference.first_state(filter.wide_covariance());
  const std::size_t shots = std::min(series.size(), kLikelihoodShots);
  std::vector<double> chi_square(shots), determinant(shots);
  FilterRun run;
  run.count = shots;
  run.gate = std::numeric_limits<double>::infinity();
  run.outlier = reference.before.outlier.data();
  run.chi_square = chi_square.data();
  run.determinant = determinant.data();
  double sum = 0;
  if (filter.run(state, run) < shots) sum = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = options.gate_after; i < shots; ++i) {  // before, the wide prior speaks
    sum -= 0.5 * (chi_square[i] + std::log(determinant[i]));
  }
  return std::isfinite(sum) ? sum : -std::numeric_limits<double>::infinity();
}

/// White acceleration of every rotor that makes the innovations likeliest: one value for all on a
/// coarse grid, then each rotor's own.
std::vector<RotorProcess> likeliest_process(const AngleSeries& series, const PrismTrain& train,
                                            const EkfOptions& options,
                                            const FilterReference& reference) {
  const auto likelihood_of = [&](const std::vector<double>& decades) {
    return likelihood(series, train, options, processes(decades), reference);
  };
  std::vector<double> decades(static_cast<std::size_t>(train.prisms()));
  double best = -std::numeric_limits<double>::infinity();
  for (double trial = 3.0; trial >= -3.0; trial -= 0.5) {
    const std::vector<double> all(decades.size(), trial);
    const double value = likelihood_of(all);
    if (value > best) {
      best = value;
      decades = all;
    }
  }
  for (std::size_t k = 0; k < decades.size(); ++k) {
    const double middle = decades[k];
    decades[k] = golden_section_minimum(
        [&](double trial) {
          std::vector<double> changed = decades;
          changed[k] = trial;
          return -likelihood_of(changed);
        },
        middle - 0.75, middle + 0.75, 0.1);
  }
  return processes(decades);
}

/// Writes the rotors of a combined state into the motion's knot of a shot; their acceleration is 0.
void take_motion(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance,
                 Eigen::Index statics, RotorTrajectory& motion, std::size_t shot) {
  const int states = motion.states();
  const auto place = [statics](int state) {
    return statics + 2 * (state / kStatesPerRotor) + state % kStatesPerRotor;
  };
  const auto is_acceleration = [](int state) { return state % kStatesPerRotor == 2; };
  const auto triangle = static_cast<std::size_t>(states * (states + 1) / 2);
  double* entry = motion.covariance.data() + shot * triangle;
  for (int a = 0; a < states; ++a) {
    if (!is_acceleration(a)) {
      motion.state_of(shot)[static_cast<std::size_t>(a)] = mean[place(a)];
    }
    for (int b = a; b < states; ++b, ++entry) {
      if (!is_acceleration(a) && !is_acceleration(b)) *entry = covariance(place(a), place(b));
    }
  }
}

/// Two independent estimates of the same states, weighted by their inverse covariances F and B:
///   mean = f + W^T y,  covariance = F - W^T W,  F + B = L L^T,  W = L^-1 F,  y = L^-1 (b - f)
/// Temporary matrices and pivots would take more than twice as many instructions.
class Combination {
 public:
  explicit Combination(Eigen::Index size)
      : mean(size), covariance(size, size), root_(size, size), share_(size, size), pull_(size) {}

  /// @param forward,backward  mean and covariance of each [states (1 + states)]
  void combine(const double* forward, const double* backward) {
    const Eigen::Index size = mean.size();
    using Vector = Eigen::Map<const Eigen::VectorXd>;
    using Matrix = Eigen::Map<const Eigen::MatrixXd>;
    mean = Vector(forward, size);
    pull_ = Vector(backward, size) - mean;
    share_ = covariance = Matrix(forward + size, size, size);
    root_ = covariance + Matrix(backward + size, size, size);
    for (Eigen::Index k = 0; k < size; ++k) {
      if (root_(k, k) <= 0) continue;  // no information in this direction
      const double scale = 1.0 / std::sqrt(root_(k, k));
      const Eigen::Index below = size - k - 1;
      root_.col(k).tail(below) *= scale;
      share_.col(k) *= scale;
      pull_[k] *= scale;
      for (Eigen::Index j = k + 1; j < size; ++j) {
        const double factor = root_(j, k);
        root_.col(j).tail(size - j) -= factor * root_.col(k).tail(size - j);
        share_.col(j) -= factor * share_.col(k);
        pull_[j] -= factor * pull_[k];
      }
      mean += pull_[k] * share_.col(k);
      for (Eigen::Index j = 0; j < size; ++j) covariance.col(j) -= share_(j, k) * share_.col(k);
    }
  }

  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;

 private:
  Eigen::MatrixXd root_, share_;  ///< L and W^T
  Eigen::VectorXd pull_;          ///< y
};

/// One forward and one backward filter and their combination.
Solution run_pass(const AngleSeries& series, const FilterState& first, const PrismTrain& train,
                  const EkfOptions& options, const std::vector<RotorProcess>& process,
                  const FilterReference* reference, std::vector<unsigned char> screened,
                  const Progress& progress) {
  const Filter filter(series, train, options, process, reference);
  const std::size_t shots = series.size();
  const Eigen::Index statics = filter.statics();
  const Eigen::Index prisms = filter.prisms();
  Solution result;
  result.rotor_process = process;
  result.outlier = std::move(screened);
  result.azimuth_residual.resize(shots);
  result.zenith_residual.resize(shots);
  RotorTrajectory& motion = result.trajectory;  // every shot is a knot
  motion.prisms = static_cast<int>(prisms);
  motion.time_ns = series.time_ns;
  motion.stretch_begin = {0};
  for (std::size_t i = 0; i < shots; ++i) {
    motion.first_shot.push_back(i);
    motion.last_shot.push_back(i + 1);
  }
  const auto states = static_cast<std::size_t>(motion.states());
  motion.state.resize(shots * states);
  motion.covariance.resize(shots * states * (states + 1) / 2);

  FilterRun open;  // without a gate
  open.gate = std::numeric_limits<double>::infinity();
  open.outlier = result.outlier.data();

  // Forward: decides on outliers and keeps the state before each block.
  std::vector<FilterState> before_block;
  FilterState state = first;
  for (std::size_t begin = 0; begin < shots;) {
    if (begin % kBlock == 0) {
      before_block.push_back(state);
      progress.report(0.3 * static_cast<double>(begin) / static_cast<double>(shots));
    }
    const bool settling = begin < options.gate_after;
    std::size_t end = std::min((begin / kBlock + 1) * kBlock, shots);
    if (settling) end = std::min(end, options.gate_after);
    FilterRun deciding = open;
    deciding.first = begin;
    deciding.count = end - begin;
    deciding.gate = settling ? kOpenGate : options.gate_chi_square;
    deciding.refused = result.outlier.data();
    begin += filter.run(state, deciding);
    if (begin < end) {
      throw EstimationError(
          fmt::format("the filter diverged at shot {} ({:.6f} s)", begin, series.time(begin)));
    }
  }
  result.outliers =
      static_cast<std::size_t>(std::count(result.outlier.begin(), result.outlier.end(), 1));

  // Backward, block by block: the forward filter runs again through the block and is combined with
  // the backward filter's information on the shots after it.
  FilterState backward{state.mean, filter.wide_covariance(), state.time_ns};
  Eigen::VectorXd mean_parameters = Eigen::VectorXd::Zero(statics);
  Eigen::MatrixXd mean_covariance = Eigen::MatrixXd::Zero(statics, statics);
  Combination both(filter.size());
  std::vector<double> angle(static_cast<std::size_t>(prisms));
  const auto size = static_cast<std::size_t>(filter.size()), kept = size * (1 + size);
  std::vector<double> filtered(kept * std::min(kBlock, shots)), predicted(filtered.size());
  for (std::size_t block = before_block.size(); block-- > 0;) {
    const std::size_t begin = block * kBlock, end = std::min(begin + kBlock, shots);
    state = before_block[block];
    FilterRun run = open;
    run.first = begin;
    run.count = end - begin;
    run.kept = filtered.data();
    filter.run(state, run);
    run.first = end - 1;
    run.backwards = true;
    run.kept = predicted.data();
    run.keep_predicted = true;
    filter.run(backward, run);
    for (std::size_t i = end; i-- > begin;) {
      both.combine(filtered.data() + kept * (i - begin), predicted.data() + kept * (end - 1 - i));
      mean_parameters += both.mean.head(statics);
      mean_covariance += both.covariance.topLeftCorner(statics, statics);
      take_motion(both.mean, both.covariance, statics, motion, i);
      for (Eigen::Index k = 0; k < prisms; ++k) {
        angle[static_cast<std::size_t>(k)] = both.mean[statics + 2 * k];
      }
      const Eigen::Vector2d residual = residual_of(
          series, i, with_free_values(train, options.free, both.mean.head(statics)), angle);
      result.azimuth_residual[i] = residual[0];
      result.zenith_residual[i] = residual[1];
    }
    progress.report(0.3 + 0.7 * static_cast<double>(shots - begin) / static_cast<double>(shots));
  }
  result.parameters = mean_parameters / static_cast<double>(shots);
  result.covariance = mean_covariance / static_cast<double>(shots);
  result.train = with_free_values(train, options.free, result.parameters);
  return result;
}

}  // namespace

Solution run_ekf(const AngleSeries& series, const Start& start, const EkfOptions& options,
                 const Progress& progress) {
  if (series.size() == 0) throw EstimationError("no valid shot to estimate from");
  require_columns(series);
  check_noise(equal_noise(options.angle_noise));
  require_at_least("passes", options.passes, 1);
  require_not_below("parameter walk", options.parameter_walk, 0, "rad/sqrt(s)");
  require_threshold("gate", options.gate_chi_square);
  require_start(start, start.train.prisms());
  require_process(options.rotor_process, start.train.prisms());
  require_free(options.free, start.train);
  check_beams(start.train, series.beam, series.size());
  const bool choose = options.rotor_process.empty();
  std::vector<RotorProcess> process =
      choose ? std::vector<RotorProcess>(static_cast<std::size_t>(start.train.prisms()),
                                         kSettlingProcess)
             : options.rotor_process;
  for (const RotorProcess& rotor : process) {
    if (rotor.jerk != 0)
      throw InvalidArgument("white jerk is a motion model of the batch estimator");
  }
  const FilterState first = first_state(Filter(series, start.train, options, process, nullptr),
                                        series, start, options.free);
  Solution result =
      run_pass(series, first, start.train, options, process, nullptr,
               screen(series, start, options, nullptr), progress.part(0.0, 1.0 / options.passes));
  for (int pass = 1; pass < options.passes; ++pass) {
    const FilterReference reference{result};
    if (choose && pass == 1) {
      process = likeliest_process(series, start.train, options, reference);
    }
    Solution next =
        run_pass(series, reference.first_state(first.covariance), start.train, options, process,
                 &reference, screen(series, start, options, &reference),
                 progress.part(double(pass) / options.passes, (pass + 1.0) / options.passes));
    result = std::move(next);
  }
  result.noise.value = equal_noise(options.angle_noise);
  SquaredAngles squares;
  squares.add(series, result.azimuth_residual, result.zenith_residual, result.outlier);
  result.unit_variance = unit_variance(squares, result.noise.value);
  result.iterations = static_cast<std::size_t>(options.passes);
  result.settled = true;
  return result;
}

}  // namespace risley::estimation
