// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation/held_parameters.hpp"

#include <algorithm>
#include <cmath>

#include "risley/algebra/symmetric.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/estimation/smoother.hpp"

#include "estimation/used_shots.hpp"

namespace risley::estimation {
namespace {

using Eigen::Index;

/// Shots that show how answers depend on held parameters: shares of them do, not sigmas.
constexpr double kSampleShots = 20000;

/// What was estimated: the free parameters, and the frame's turn where that was free.
const std::vector<FreeParameter>& constants_of(const Estimate& estimate) {
  return estimate.constants.empty() ? estimate.free : estimate.constants;
}

/// Held parameters that some answer depends on.
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

/// Some of the shots that an estimate used, with knots of their own on its trajectory.
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

}  // namespace

HeldChanges changes_by_held_parameters(const Estimate& estimate, const sensors::Sensor& sensor) {
  HeldChanges result;
  result.held = telling_held(estimate, sensor);
  const std::vector<FreeParameter>& held = result.held;
  std::vector<FreeParameter> all = constants_of(estimate);
  const auto free = static_cast<Index>(all.size());
  const auto parameters = static_cast<Index>(estimate.free.size());
  const Index prisms = sensor.prisms();
  const auto count = static_cast<Index>(held.size());
  Eigen::MatrixXd& changes = result.values;
  changes = Eigen::MatrixXd::Zero(parameters + 2 * prisms, count);
  result.mean_angles = Eigen::MatrixXd::Zero(prisms, count);
  if (count == 0) return result;
  all.insert(all.end(), held.begin(), held.end());

  const Sample sample(estimate);
  NormalEquations equations;
  accumulate(sample.series, sample.knots, estimate.train, all, weights_of(estimate), equations);
  equations.scale(1.0 / sample.share / estimate.variance_factor);
  ParameterPrior prior;
  prior.information.resize(free + count);
  prior.gradient = Eigen::VectorXd::Zero(free + count);
  for (Index j = 0; j < free + count; ++j) {
    const double sigma = all[static_cast<std::size_t>(j)].prior_sigma;
    prior.information[j] = 1.0 / (sigma * sigma);
  }
  const SmootherSolution solution =
      smooth(equations, sample.knots, estimate.rotor_process, prior, true);
  Eigen::MatrixXd information = solution.parameter_information.topLeftCorner(free, free);
  information.diagonal() += prior.information.head(free);
  Eigen::MatrixXd constants(free + count, count);  // d constants / d held
  constants.topRows(free) =
      -algebra::SymmetricSolver(information)
           .solve_columns(solution.parameter_information.topRightCorner(free, count));
  constants.bottomRows(count).setIdentity();
  for (Index j = 0; j < count; ++j) {
    constants.col(j) *= held[static_cast<std::size_t>(j)].prior_sigma;
  }

  const RotorTrajectory& knots = sample.knots;
  const auto angles_of = [&](std::size_t knot) -> Eigen::MatrixXd {
    const auto own = solution.sensitivity(knot, knots.states());
    Eigen::MatrixXd angles(prisms, count);
    for (Index k = 0; k < prisms; ++k) angles.row(k) = own.row(kStatesPerRotor * k) * constants;
    return angles;
  };
  changes.topRows(parameters) = constants.topRows(parameters);
  double time = 0;
  for (std::size_t s = 0; s < knots.stretch_begin.size(); ++s) {
    const std::size_t first = knots.stretch_begin[s], last = knots.stretch_end(s) - 1;
    changes.middleRows(parameters, prisms) += angles_of(last) - angles_of(first);
    time += 1e-9 * static_cast<double>(knots.time_ns[last] - knots.time_ns[first]);
  }
  if (time > 0) changes.middleRows(parameters, prisms) /= time;
  changes.bottomRows(prisms) = angles_of(0);
  for (std::size_t knot = 0; knot < knots.size(); ++knot) result.mean_angles += angles_of(knot);
  result.mean_angles /= static_cast<double>(knots.size());
  return result;
}

}  // namespace risley::estimation
