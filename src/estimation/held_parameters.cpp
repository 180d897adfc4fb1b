// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation/held_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "risley/algebra/symmetric.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/estimation/smoother.hpp"

#include "estimation/used_shots.hpp"

namespace risley::estimation {
namespace {

using Eigen::Index;

/// Number of shots used for the dependence of results on held parameters: shares matter, not
/// sigmas.
constexpr double kSampleShots = 20000;

/// The estimated constants: the free parameters, and the frame's turn if that was free.
const std::vector<FreeParameter>& constants_of(const Estimate& estimate) {
  return estimate.constants.empty() ? estimate.free : estimate.constants;
}

/// Held parameters that affect some result.
std::vector<FreeParameter> telling_held(const Estimate& estimate, const sensors::Sensor& sensor) {
  std::vector<FreeParameter> held = uncertain_held(sensor, constants_of(estimate));
  const std::vector<std::size_t> shots = estimate.series.shots_of_beams();
  std::erase_if(held, [&](const FreeParameter& parameter) {
    const int emitter = place::emitter(parameter.places.front(), sensor.prisms());
    const auto beam = static_cast<std::size_t>(emitter);
    return emitter >= 0 && (beam >= shots.size() || shots[beam] == 0);
  });
  return held;
}

/// Some of the shots used in an estimate, with separate knots on its trajectory.
struct Sample {
  PackedSeries series;
  RotorTrajectory knots;
  double share = 1;  // of the shots

  explicit Sample(const Estimate& estimate) {
    const RotorTrajectory& motion = estimate.trajectory;
    std::vector<ShotRange> ranges;
    for (std::size_t s = 0; s < motion.stretch_begin.size(); ++s) {
      ranges.push_back({motion.first_shot[motion.stretch_begin[s]],
                        motion.last_shot[motion.stretch_end(s) - 1]});
    }
    const auto all = static_cast<double>(estimate.series.size());
    const AngleSeries beginning =
        estimate.series.rows({0, std::min(kMedianSteps, estimate.series.size())});
    const double step =
        1e-9 * static_cast<double>(std::max<std::int64_t>(1, median_step_ns(beginning.time_ns)));
    series = kSampleShots < all ? thinned(estimate.series, kSampleShots / all / step, ranges)
                                : estimate.series;
    share = static_cast<double>(series.size()) / all;
    knots = make_knots(series, ranges, motion.prisms);
    interpolate(motion, knots);
  }
};

/// One Gauss-Newton step of a sample of the shots, weighted as all of them together. The prior of
/// the constants pulls towards their current values.
SmootherSolution step_of(const Estimate& estimate, const Sample& sample,
                         const RotorTrajectory& knots, const PrismTrain& train,
                         const std::vector<FreeParameter>& constants) {
  NormalEquations equations;
  accumulate(sample.series, knots, train, constants, weights_of(estimate), equations);
  equations.scale(1.0 / sample.share / estimate.variance_factor);
  const auto count = static_cast<Index>(constants.size());
  ParameterPrior prior{Eigen::VectorXd(count), Eigen::VectorXd::Zero(count)};
  for (Index j = 0; j < count; ++j) {
    const double sigma = constants[static_cast<std::size_t>(j)].prior_sigma;
    prior.information[j] = 1.0 / (sigma * sigma);
  }
  return smooth(equations, knots, estimate.rotor_process, prior, true);
}

/// Derivatives of the constants and of the held parameters themselves by these, as far as the data
/// determine the constants, times one sigma of each [free + held, held].
/// @param solution  of free and held parameters together
Eigen::MatrixXd changes_of_constants(const SmootherSolution& solution,
                                     const std::vector<FreeParameter>& all, Index free) {
  const Index count = static_cast<Index>(all.size()) - free;
  Eigen::MatrixXd information = solution.parameter_information.topLeftCorner(free, free);
  for (Index j = 0; j < free; ++j) {
    const double sigma = all[static_cast<std::size_t>(j)].prior_sigma;
    information(j, j) += 1.0 / (sigma * sigma);
  }
  Eigen::MatrixXd changes(free + count, count);
  changes.topRows(free) =
      -algebra::SymmetricSolver(information)
           .solve_columns(solution.parameter_information.topRightCorner(free, count));
  changes.bottomRows(count).setIdentity();
  for (Index j = 0; j < count; ++j) {
    changes.col(j) *= all[static_cast<std::size_t>(free + j)].prior_sigma;
  }
  return changes;
}

/// The second-order effect of one sigma of a held parameter: the mean of both signs relative to no
/// change, by one step from either end of the first order.
/// @param solution  of free and held parameters together, which the rotors follow
/// @param centre  step of the constants [free] from no change
/// @param change    of the constants [free + held]
/// @return of the constants [free] and of the states of the knots
std::pair<Eigen::VectorXd, std::vector<double>> second_order(const Estimate& estimate,
                                                             const Sample& sample,
                                                             const SmootherSolution& solution,
                                                             const SmootherSolution& centre,
                                                             const std::vector<FreeParameter>& all,
                                                             const Eigen::VectorXd& change) {
  const std::vector<FreeParameter>& constants = constants_of(estimate);
  const Eigen::VectorXd values = free_values(estimate.train, all);
  Eigen::VectorXd curve = -centre.parameter_step;
  std::vector<double> states(centre.state_step.size());
  std::ranges::transform(centre.state_step, states.begin(), std::negate());
  for (const double sign : {1.0, -1.0}) {
    RotorTrajectory moved = sample.knots;
    for (std::size_t knot = 0; knot < moved.size(); ++knot) {
      const auto state = moved.state_of(knot);
      Eigen::Map<Eigen::VectorXd>(state.data(), moved.states()) +=
          sign * (solution.sensitivity(knot, moved.states()) * change);
    }
    const PrismTrain train = with_free_values(estimate.train, all, values + sign * change);
    const SmootherSolution step = step_of(estimate, sample, moved, train, constants);
    curve += 0.5 * step.parameter_step;
    for (std::size_t i = 0; i < states.size(); ++i) states[i] += 0.5 * step.state_step[i];
  }
  return {std::move(curve), std::move(states)};
}

/// Effect on the results: the free parameters, mean speeds and first angles of the rotors.
/// @param angles_of  changes of the rotation angles at a knot [prisms, columns]
template <class Angles>
Eigen::MatrixXd changes_of_values(const Eigen::MatrixXd& parameters, const RotorTrajectory& knots,
                                  const Angles& angles_of) {
  const Index prisms = knots.prisms, columns = parameters.cols();
  Eigen::MatrixXd turned = Eigen::MatrixXd::Zero(prisms, columns);
  double time = 0;
  for (std::size_t s = 0; s < knots.stretch_begin.size(); ++s) {
    const std::size_t first = knots.stretch_begin[s], last = knots.stretch_end(s) - 1;
    turned += angles_of(last) - angles_of(first);
    time += 1e-9 * static_cast<double>(knots.time_ns[last] - knots.time_ns[first]);
  }
  if (time > 0) turned /= time;
  Eigen::MatrixXd changes(parameters.rows() + 2 * prisms, columns);
  changes << parameters, turned, angles_of(0);
  return changes;
}

}  // namespace

Eigen::MatrixXd HeldChanges::covariance(std::size_t one, Index rows) const {
  constexpr double kMeanFourthPower = 3.0;  // of x
  const Eigen::VectorXd first = values.col(static_cast<Index>(one)).head(rows);
  const Eigen::VectorXd second = curves.col(static_cast<Index>(one)).head(rows);
  return first * first.transpose() + kMeanFourthPower * second * second.transpose();
}

HeldChanges changes_by_held_parameters(const Estimate& estimate, const sensors::Sensor& sensor) {
  HeldChanges result;
  result.held = telling_held(estimate, sensor);
  std::vector<FreeParameter> all = constants_of(estimate);
  const auto free = static_cast<Index>(all.size());
  const auto parameters = static_cast<Index>(estimate.free.size());
  const Index prisms = sensor.prisms();
  const auto count = static_cast<Index>(result.held.size());
  result.values = Eigen::MatrixXd::Zero(parameters + 2 * prisms, count);
  result.curves = result.values;
  result.mean_angles = Eigen::MatrixXd::Zero(prisms, count);
  if (count == 0) return result;
  all.insert(all.end(), result.held.begin(), result.held.end());

  const Sample sample(estimate);
  const RotorTrajectory& knots = sample.knots;
  const SmootherSolution solution = step_of(estimate, sample, knots, estimate.train, all);
  const Eigen::MatrixXd constants = changes_of_constants(solution, all, free);
  const auto angles_of = [&](std::size_t knot) -> Eigen::MatrixXd {
    const auto own = solution.sensitivity(knot, knots.states());
    Eigen::MatrixXd angles(prisms, count);
    for (Index k = 0; k < prisms; ++k) angles.row(k) = own.row(kStatesPerRotor * k) * constants;
    return angles;
  };
  result.values = changes_of_values(constants.topRows(parameters), knots, angles_of);
  for (std::size_t knot = 0; knot < knots.size(); ++knot) result.mean_angles += angles_of(knot);
  result.mean_angles /= static_cast<double>(knots.size());

  // Only behind a reflection is the dependence on a held parameter visibly curved.
  if (!sensor.shape().prisms.reflects()) return result;
  const SmootherSolution centre =
      step_of(estimate, sample, knots, estimate.train, constants_of(estimate));
  for (Index j = 0; j < count; ++j) {
    const auto [curve, states] =
        second_order(estimate, sample, solution, centre, all, constants.col(j));
    const auto curve_of_angles = [&, &steps = states](std::size_t knot) -> Eigen::MatrixXd {
      Eigen::MatrixXd angles(prisms, 1);
      for (Index k = 0; k < prisms; ++k) {
        angles(k, 0) = steps[knot * static_cast<std::size_t>(knots.states()) +
                             static_cast<std::size_t>(kStatesPerRotor * k)];
      }
      return angles;
    };
    result.curves.col(j) = changes_of_values(curve.head(parameters), knots, curve_of_angles);
  }
  return result;
}

}  // namespace risley::estimation
