// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/observability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "risley/algebra/products.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/estimation/smoother.hpp"
#include "risley/optics/observation_model.hpp"

#include "estimation/bound.hpp"
#include "estimation/used_shots.hpp"

namespace risley::estimation {

namespace {

/// Share of the work due to the shots' equations and the smoother.
constexpr double kShotsShare = 0.5;
constexpr std::size_t kMostPlannedShots = 600000;
constexpr double kMostDuration = 2000.0;
/// From this correlation on two quantities are hard to separate.
constexpr double kStrong = 0.9;
/// From this correlation on they are equivalent.
constexpr double kTwin = 0.98;

/// Every parameter of the prisms that exists. Those of all prisms together represent each prism's
/// own if the prisms share a value and none of them is free alone.
std::vector<FreeParameter> all_parameters(const PrismTrain& train,
                                          const std::vector<FreeParameter>& free) {
  const TrainShape shape = train.shape();
  const auto together = [&](const std::vector<int>& places) {
    bool alone = false, equal = true;
    for (const FreeParameter& parameter : free) {
      if (parameter.places == places) return true;
      alone = alone ||
              std::find(places.begin(), places.end(), parameter.places.front()) != places.end();
    }
    for (const int place : places) equal = equal && train[place] == train[places.front()];
    return equal && !alone;
  };
  std::vector<std::string> names;
  std::vector<int> taken;
  for (const ParameterInfo& info : parameter_list(shape)) {
    if (info.kind != ParameterKind::train) continue;
    const bool shared = info.name == "refractive_index" || info.name == "wedge_angle_deg";
    if (shared && !together(info.places)) continue;
    if (std::find(taken.begin(), taken.end(), info.places.front()) != taken.end()) continue;
    names.push_back(info.name);
    taken.insert(taken.end(), info.places.begin(), info.places.end());
  }
  return free_parameters(names, shape);
}

/// The parameter of a list that corresponds to a free one; -1: none.
Eigen::Index row_of(const FreeParameter& parameter, const std::vector<FreeParameter>& all) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const FreeParameter& one) {
    return one.places == parameter.places;
  });
  return found == all.end() ? -1 : found - all.begin();
}

/// Parameters and the rotors' states in the middle of a recording, as one linear model: the states
/// are s = S p + rest, where the rest has a covariance of its own.
struct Middle {
  Eigen::MatrixXd sensitivity;  ///< [2 prisms, all]: angles, then speeds
  Eigen::MatrixXd rest;         ///< [2 prisms, 2 prisms]
};

Middle middle_of(const SmootherSolution& solution, const RotorTrajectory& knots) {
  const Eigen::Index d = knots.states(), n = solution.parameter_covariance.rows();
  const std::size_t knot = knots.size() / 2;
  const Eigen::MatrixXd all = solution.sensitivity(knot, d);
  Eigen::MatrixXd total(d, d);
  const double* entry =
      solution.state_covariance.data() + knot * static_cast<std::size_t>(d * (d + 1) / 2);
  for (Eigen::Index i = 0; i < d; ++i) {
    for (Eigen::Index j = i; j < d; ++j) total(i, j) = total(j, i) = *entry++;
  }
  total -= algebra::propagated(all, solution.parameter_covariance);
  Middle middle{Eigen::MatrixXd(2 * knots.prisms, n),
                Eigen::MatrixXd(2 * knots.prisms, 2 * knots.prisms)};
  const auto row_of = [&](Eigen::Index i) {
    return i < knots.prisms ? kStatesPerRotor * i : kStatesPerRotor * (i - knots.prisms) + 1;
  };
  for (Eigen::Index i = 0; i < 2 * knots.prisms; ++i) {
    middle.sensitivity.row(i) = all.row(row_of(i));
    for (Eigen::Index j = 0; j < 2 * knots.prisms; ++j) {
      middle.rest(i, j) = total(row_of(i), row_of(j));
    }
  }
  return middle;
}

/// Covariance of some parameters and the states in the middle, from that of the parameters.
Eigen::MatrixXd joint_covariance(const Eigen::MatrixXd& parameters, const Middle& middle,
                                 const std::vector<Eigen::Index>& rows) {
  const auto n = static_cast<Eigen::Index>(rows.size()), m = middle.rest.rows();
  Eigen::MatrixXd sensitivity(m, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    sensitivity.col(i) = middle.sensitivity.col(rows[static_cast<std::size_t>(i)]);
  }
  Eigen::MatrixXd joint(n + m, n + m);
  joint.topLeftCorner(n, n) = parameters;
  joint.bottomLeftCorner(m, n) = algebra::product(sensitivity, parameters);
  joint.topRightCorner(n, m) = joint.bottomLeftCorner(m, n).transpose();
  joint.bottomRightCorner(m, m) = middle.rest + algebra::propagated(sensitivity, parameters);
  return joint;
}

/// Sorts by strength and leaves the strongest and those beyond kTwin.
void keep_strongest(std::vector<std::pair<std::string, double>>& twins) {
  std::stable_sort(twins.begin(), twins.end(), [](const auto& a, const auto& b) {
    return std::abs(a.second) > std::abs(b.second);
  });
  std::size_t kept = std::min<std::size_t>(1, twins.size());
  while (kept < twins.size() && std::abs(twins[kept].second) >= kTwin) ++kept;
  twins.resize(kept);
}

/// Everything from the normal equations with all parameters.
/// @param information_per_square  shots over the variance of an angle, 1 / rad^2
Observability analyse(const NormalEquations& equations, const RotorTrajectory& knots,
                      const std::vector<RotorProcess>& process,
                      const std::vector<FreeParameter>& all, const std::vector<FreeParameter>& free,
                      double duration, double shots, double information_per_square,
                      const Progress& progress) {
  const auto n = static_cast<Eigen::Index>(all.size());
  const Eigen::Index prisms = knots.prisms;
  ParameterPrior prior{Eigen::VectorXd(n), Eigen::VectorXd::Zero(n)};
  Eigen::VectorXd scale(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    scale[i] = all[static_cast<std::size_t>(i)].prior_sigma;
    prior.information[i] = 1.0 / (scale[i] * scale[i]);
  }
  progress.check();
  const SmootherSolution solution = smooth(equations, knots, process, prior, true);
  const Middle middle = middle_of(solution, knots);

  Observability result;
  result.shots = shots;
  result.duration = duration;
  result.rate = duration > 0 ? shots / duration : 0;
  result.unobservable = weak_directions(solution.parameter_information, all, 1.0);
  for (const FreeParameter& parameter : all) result.correlation_names.push_back(parameter.name);
  for (const char* quantity : {"rotation_angle_{}_deg", "angular_velocity_{}_deg_per_s"}) {
    for (int k = 0; k < knots.prisms; ++k) {
      result.correlation_names.push_back(fmt::format(fmt::runtime(quantity), prism_letter(k)));
    }
  }
  std::vector<Eigen::Index> every(all.size());
  for (std::size_t i = 0; i < every.size(); ++i) every[i] = static_cast<Eigen::Index>(i);
  const Eigen::MatrixXd joint = joint_covariance(solution.parameter_covariance, middle, every);
  const Eigen::VectorXd inverse_sigma = joint.diagonal().array().rsqrt();
  result.correlation = algebra::scaled(joint, inverse_sigma);

  std::vector<Eigen::Index> chosen;
  for (const FreeParameter& parameter : free) {
    const Eigen::Index row = row_of(parameter, all);
    if (row >= 0) chosen.push_back(row);
  }
  // One quantity among parameters and the states in the middle.
  const auto describe = [&](Eigen::Index quantity, std::vector<Eigen::Index> rows) {
    QuantityObservability found;
    found.name = result.correlation_names[static_cast<std::size_t>(quantity)];
    const bool parameter = quantity < n;
    const auto at = std::find(rows.begin(), rows.end(), quantity);
    found.free = !parameter || at != rows.end();
    if (parameter && at == rows.end()) rows.push_back(quantity);
    const Eigen::MatrixXd& information = solution.parameter_information;
    const std::optional<Eigen::MatrixXd> covariance =
        bound_covariance(information(rows, rows), scale(rows));
    if (!covariance) {
      found.sigma = std::numeric_limits<double>::infinity();
      // Its inseparable partners show under the wide priors.
      for (Eigen::Index j = 0; j < result.correlation.rows(); ++j) {
        if (j == quantity) continue;
        found.twins.emplace_back(result.correlation_names[static_cast<std::size_t>(j)],
                                 result.correlation(quantity, j));
      }
      keep_strongest(found.twins);
      return found;
    }
    const Eigen::MatrixXd both = joint_covariance(*covariance, middle, rows);
    const auto count = static_cast<Eigen::Index>(rows.size());
    const Eigen::Index place = parameter
                                   ? std::find(rows.begin(), rows.end(), quantity) - rows.begin()
                                   : count + quantity - n;
    found.sigma = std::sqrt(both(place, place));
    for (Eigen::Index j = 0; j < both.rows(); ++j) {
      if (j == place) continue;
      const Eigen::Index name = j < count ? rows[static_cast<std::size_t>(j)] : n + j - count;
      found.twins.emplace_back(result.correlation_names[static_cast<std::size_t>(name)],
                               both(place, j) / std::sqrt(both(place, place) * both(j, j)));
    }
    keep_strongest(found.twins);
    return found;
  };
  for (Eigen::Index i = 0; i < n + 2 * prisms; ++i) {
    progress.report(kShotsShare + (1.0 - kShotsShare) * static_cast<double>(i) /
                                      static_cast<double>(n + 2 * prisms));
    QuantityObservability quantity = describe(i, chosen);
    double squares = 0;
    if (i < n) {
      squares = equations.static_hessian(i, i);
    } else {
      // Entry (k, k) of the pairs of rotors; sums over all knots.
      const Eigen::Index k = (i - n) % prisms;
      const Eigen::Index pair = k * prisms - k * (k - 1) / 2;
      const Eigen::Index pairs = prisms * (prisms + 1) / 2;
      for (std::size_t knot = 0; knot < knots.size(); ++knot) {
        squares += equations.curvature[(knot * static_cast<std::size_t>(pairs) +
                                        static_cast<std::size_t>(pair)) *
                                       5];
      }
      if (i >= n + prisms) squares *= duration * duration / 12.0;
    }
    quantity.sensitivity = std::sqrt(squares / information_per_square);
    result.quantities.push_back(std::move(quantity));
  }
  return result;
}

}  // namespace

Observability observability_of_plan(const ObservabilityPlan& plan, const Progress& progress) {
  require_above("duration", plan.duration, 0, "s");
  require_above("rate", plan.rate, 0, "Hz");
  const double variance =
      plan.angle_noise * plan.angle_noise + plan.angle_resolution * plan.angle_resolution / 12.0;
  require_above("noise and rounding", variance, 0, "rad^2");
  const PrismTrain& train = plan.sensor.train;
  require_length("angular_velocity of the sensor", plan.sensor.angular_velocity.size(),
                 static_cast<std::size_t>(train.prisms()));
  const double duration = std::min(plan.duration, kMostDuration);
  const double shots = plan.duration * plan.rate;
  const double rate = std::min(plan.rate, static_cast<double>(kMostPlannedShots) / duration);
  const auto count = static_cast<std::size_t>(std::floor(duration * rate)) + 1;

  AngleSeries series;
  std::vector<double> angles(static_cast<std::size_t>(train.prisms()));
  for (std::size_t i = 0; i < count; ++i) {
    if (i % 65536 == 0) progress.check();
    const double t = static_cast<double>(i) / rate;
    const std::int64_t time_ns = std::llround(1e9 * t);
    for (std::size_t k = 0; k < angles.size(); ++k) {
      angles[k] =
          wrap_to_pi(plan.sensor.angular_velocity[k] * (1e-9 * static_cast<double>(time_ns)));
    }
    const int emitter = static_cast<int>(i % static_cast<std::size_t>(train.emitters()));
    const Observation shot = observe(train, angles, emitter);
    series.append(time_ns, shot.azimuth, shot.zenith, static_cast<std::uint8_t>(emitter));
  }
  const ShotRange range{0, series.size()};
  RotorTrajectory knots = make_knots(series, {&range, 1}, train.prisms());
  for (std::size_t knot = 0; knot < knots.size(); ++knot) {
    const auto state = knots.state_of(knot);
    for (std::size_t k = 0; k < angles.size(); ++k) {
      const double speed = plan.sensor.angular_velocity[k];
      state[kStatesPerRotor * k] = speed * (1e-9 * static_cast<double>(knots.time_ns[knot]));
      state[kStatesPerRotor * k + 1] = speed;
    }
  }
  std::vector<RotorProcess> process = plan.rotor_process;
  if (process.empty()) process.assign(angles.size(), kTypicalRotor);
  const std::vector<FreeParameter> all = all_parameters(train, plan.free);
  NormalEquations equations;
  // Fewer shots represent all of them.
  const double share = shots / static_cast<double>(count);
  const ShotWeights weights{equal_noise(std::sqrt(variance / share)), 0.0};
  accumulate(series, knots, train, all, weights, equations);
  Observability result = analyse(equations, knots, process, all, plan.free, plan.duration, shots,
                                 shots / variance, progress);
  result.emitters =
      compare_emitters(series, knots, train, process, plan.free, weights, 1.0, progress);
  return result;
}

Observability observability_of_estimate(const Estimate& estimate, const Progress& progress) {
  const std::vector<FreeParameter> all = all_parameters(estimate.train, estimate.free);
  NormalEquations equations;
  const ShotWeights weights = weights_of(estimate);
  accumulate(estimate.series, estimate.trajectory, estimate.train, all, weights, equations);
  equations.scale(1.0 / estimate.variance_factor);
  const double shots = static_cast<double>(equations.shots - equations.outliers);
  const double variance =
      estimate.expected_residual * estimate.expected_residual * estimate.variance_factor;
  double duration = 0;
  for (const ShotRange& range : stretches(estimate.series)) {
    duration += 1e-9 * static_cast<double>(estimate.series.time_ns(range.end - 1) -
                                           estimate.series.time_ns(range.begin));
  }
  Observability result = analyse(equations, estimate.trajectory, estimate.rotor_process, all,
                                 estimate.free, duration, shots, shots / variance, progress);
  if (estimate.train.emitters() > 1) {
    result.emitters = compare_emitters(estimate.series.rows(), estimate.trajectory, estimate.train,
                                       estimate.rotor_process, estimate.free, weights,
                                       1.0 / estimate.variance_factor, progress);
  }
  return result;
}

std::vector<std::string> observability_words(const Observability& observability, TrainShape shape) {
  std::vector<std::string> words;
  for (const QuantityObservability& quantity : observability.quantities) {
    const ParameterInfo& info = find_parameter(quantity.name, shape);
    if (info.kind != ParameterKind::train) continue;
    const std::string unit = info.unit == "1" ? "" : " " + info.unit;
    const double sigma = quantity.sigma / info.si_per_unit;
    std::string twins;
    for (const auto& [name, rho] : quantity.twins) {
      if (!twins.empty()) twins += " or ";
      twins += std::abs(rho) < kStrong ? name : fmt::format("{} (rho = {:.4f})", name, rho);
    }
    const std::string twin = fmt::format("{} cannot be separated from {}", quantity.name, twins);
    if (!std::isfinite(sigma)) {
      words.push_back(twin + ", however long a sensor with these parameters records: keep it held");
      continue;
    }
    if (quantity.free || std::abs(quantity.twins.front().second) < kStrong) continue;
    // Worth freeing it: a hundredth of a degree, or 1e-5 of an index.
    const double target = info.unit == "1" ? 1e-5 : 0.01;
    const double needed = observability.duration * std::pow(sigma / target, 2);
    const std::string seconds =
        needed < 1000 ? fmt::format("{:.3g}", needed) : fmt::format("{:.0f}", needed);
    if (needed <= observability.duration) {
      words.push_back(fmt::format(
          "{} acts nearly like {}, but this recording separates them: freed, its sigma "
          "is {:.2g}{}, and {} s at {:.6g} Hz reach {}{}",
          quantity.name, twins, sigma, unit, seconds, observability.rate, target, unit));
    } else {
      words.push_back(fmt::format(
          "{}: keep it fixed. Freed, its sigma is {:.2g}{}; {}{} would take {} s at {:.6g} Hz",
          twin, sigma, unit, target, unit, seconds, observability.rate));
    }
  }
  for (std::string& one : emitter_words(observability.emitters)) words.push_back(std::move(one));
  return words;
}

}  // namespace risley::estimation
