// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/initialisation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/normal_equations.hpp"

#include "estimation/knot_model.hpp"
#include "estimation/line_fit.hpp"
#include "estimation/residual_model.hpp"

namespace risley::estimation {
namespace {

/// Slowest change of a speed that a fit over the first shots leaves to the rotors, rad/s^2.
constexpr double kAccelerationSigma = radians_from_degrees(200.0);

/// A fit of parameters and one parabola per rotor to a few shots.
struct WindowFit {
  PrismTrain train;
  RotorTrajectory knot;  // a single one
  double rms = std::numeric_limits<double>::infinity();
};

/// Robust least squares with Levenberg's damping: first the motion, then the parameters too.
WindowFit fit_window(const AngleSeries& shots, const PrismTrain& nominal,
                     const std::vector<FreeParameter>& free, RotorTrajectory knot, double noise) {
  const int prisms = knot.prisms;
  const auto n = static_cast<Eigen::Index>(free.size());
  const Eigen::Index d = 3 * prisms;
  const Eigen::VectorXd prior = free_values(nominal, free);
  WindowFit fit{nominal, std::move(knot)};
  NormalEquations equations;
  std::vector<double> azimuth(shots.size()), zenith(shots.size());
  ShotWeights weights;
  weights.angle_noise = noise;

  /// Residual scale that half of the shots keep, as a standard deviation, rad.
  const auto scale = [&] { return robust_scale(azimuth, zenith); };
  const auto prior_cost = [&](const Eigen::VectorXd& values, const RotorTrajectory& motion) {
    double cost = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double sigma = free[static_cast<std::size_t>(i)].prior_sigma;
      cost += std::pow((values[i] - prior[i]) / sigma, 2);
    }
    for (int k = 0; k < prisms; ++k) {
      cost += std::pow(motion.state[static_cast<std::size_t>(3 * k + 2)] / kAccelerationSigma, 2);
    }
    return cost;
  };
  const auto evaluate = [&](const PrismTrain& train, const RotorTrajectory& motion) {
    accumulate(shots, motion, train, free, weights, equations, {azimuth, zenith, {}});
    return equations.cost + prior_cost(free_values(train, free), motion);
  };

  evaluate(fit.train, fit.knot);
  for (const bool move_parameters : {false, true}) {
    double damping = 1e-4;
    for (int iteration = 0; iteration < 25; ++iteration) {
      const double level = std::max(scale() / noise, 1.0);
      weights.softening = softening_at(level);
      double cost = evaluate(fit.train, fit.knot);
      Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(d + n, d + n);
      Eigen::VectorXd gradient(d + n);
      with_prism_count(
          prisms, [&]<int N>() { normal.topLeftCorner(d, d) = knot_curvature<N>(equations, 0); });
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      normal.topRightCorner(d, n) = Eigen::Map<const RowMajor>(equations.coupling.data(), d, n);
      normal.bottomLeftCorner(n, d) = normal.topRightCorner(d, n).transpose();
      normal.bottomRightCorner(n, n) = equations.static_hessian;
      gradient.head(d) = Eigen::Map<const Eigen::VectorXd>(equations.gradient.data(), d);
      gradient.tail(n) = equations.static_gradient;
      const Eigen::VectorXd values = free_values(fit.train, free);
      for (Eigen::Index i = 0; i < n; ++i) {
        const double sigma = free[static_cast<std::size_t>(i)].prior_sigma;
        normal(d + i, d + i) += 1.0 / (sigma * sigma);
        gradient[d + i] += (prior[i] - values[i]) / (sigma * sigma);
      }
      for (Eigen::Index k = 0; k < prisms; ++k) {
        const double weight = 1.0 / (kAccelerationSigma * kAccelerationSigma);
        normal(3 * k + 2, 3 * k + 2) += weight;
        gradient[3 * k + 2] -= weight * fit.knot.state[static_cast<std::size_t>(3 * k + 2)];
      }
      bool moved = false, done = false;
      while (!moved && damping < 1e6) {
        Eigen::MatrixXd damped = normal;
        damped.diagonal() *= 1.0 + damping;
        if (!move_parameters) damped.diagonal().tail(n).array() *= 1e12;
        const Eigen::VectorXd step = damped.ldlt().solve(gradient);
        PrismTrain train = with_free_values(fit.train, free, values + step.tail(n));
        RotorTrajectory motion = fit.knot;
        for (Eigen::Index i = 0; i < d; ++i) motion.state[static_cast<std::size_t>(i)] += step[i];
        const double trial = evaluate(train, motion);
        if (trial < cost) {
          done = cost - trial < 1e-6 * cost;
          fit.train = std::move(train);
          fit.knot = std::move(motion);
          damping = std::max(damping / 10.0, 1e-9);
          moved = true;
        } else {
          damping = std::max(10.0 * damping, 1e-3);
        }
      }
      if (!moved || done) break;
    }
    evaluate(fit.train, fit.knot);
  }
  fit.rms = scale();
  if (!std::isfinite(fit.rms)) fit.rms = std::numeric_limits<double>::infinity();
  return fit;
}

/// Residual, rad, below which a start is taken: behind a good fit only noise, rounding and the
/// wander of the speeds over 0.1 s remain.
double good_start_residual(const AngleSeries& head, double angle_noise) {
  const double rounding = std::sqrt(static_cast<double>(head.zenith_rounding_variance.front()));
  return 1.5 * (angle_noise + rounding) + radians_from_degrees(0.02);
}

/// A start from lines that stand for the given shots.
Start start_from(const AngleSeries& shots, const RotorLines& found, const sensors::Sensor& sensor,
                 const std::vector<FreeParameter>& free, double noise) {
  const RotorIdentification rotors = identify_rotors(found.lines, sensor);
  const ShotRange all{0, shots.size()};
  RotorTrajectory knot = make_knots(shots, {&all, 1}, sensor.prisms(), 1e9);
  knot.time_ns[0] = found.time_ns;
  for (std::size_t k = 0; k < rotors.line.size(); ++k) {
    // At rotation angle zero the beam leans to -Z, so a line's phase is the angle less 90 degrees.
    knot.state[3 * k] = rotors.line[k].phase + kPi / 2;
    knot.state[3 * k + 1] = rotors.line[k].angular_velocity;
  }
  const WindowFit fit = fit_window(shots, sensor.train, free, knot, noise);
  Start start;
  start.time_ns = found.time_ns;
  start.reach = 1e-9 * static_cast<double>(std::max(found.time_ns - shots.time_ns.front(),
                                                    shots.time_ns.back() - found.time_ns));
  start.train = fit.train;
  start.combination = rotors.combination;
  start.residual_rms = fit.rms;
  for (std::size_t k = 0; k < rotors.line.size(); ++k) {
    start.rotation_angle.push_back(wrap_to_pi(fit.knot.state[3 * k]));
    start.angular_velocity.push_back(fit.knot.state[3 * k + 1]);
    start.line_offset.push_back(wrap_to_pi(fit.knot.state[3 * k] - rotors.line[k].phase));
  }
  return start;
}

}  // namespace

RotorIdentification identify_rotors(const std::vector<SpectralLine>& lines,
                                    const sensors::Sensor& sensor) {
  if (sensor.prisms() != 2 || lines.size() != 2) {
    throw InvalidArgument(fmt::format("{} has {} prisms; the start knows sensors with 2",
                                      sensor.name, sensor.prisms()));
  }
  using sensors::SpeedCombination;
  std::vector<sensors::Sensor> candidates{sensor};
  if (sensor.combination) {
    const bool is_first = *sensor.combination == SpeedCombination::first;
    candidates.push_back(
        with_combination(sensor, is_first ? SpeedCombination::second : SpeedCombination::first));
  }
  RotorIdentification best;
  double best_miss = 0.2;
  double clock = 1.0;  // ratio of both speeds to the sensor's, when it is one
  for (const sensors::Sensor& candidate : candidates) {
    for (const auto& order : {std::pair(0, 1), std::pair(1, 0)}) {
      const SpectralLine& a = lines[static_cast<std::size_t>(order.first)];
      const SpectralLine& b = lines[static_cast<std::size_t>(order.second)];
      const double ratio_a = a.angular_velocity / candidate.angular_velocity[0];
      const double ratio_b = b.angular_velocity / candidate.angular_velocity[1];
      const double worst = std::max(std::abs(ratio_a - 1.0), std::abs(ratio_b - 1.0));
      if (worst < best_miss) {
        best_miss = worst;
        best = {{a, b}, candidate.combination};
      }
      if (ratio_a > 0 && std::abs(ratio_a / ratio_b - 1.0) < 0.01) clock = ratio_a;
    }
  }
  if (best.line.empty()) {
    const std::string words = fmt::format(
        "the beam turns at {:.0f} and {:.0f} deg/s, which is no combination of {}'s {:.0f} and "
        "{:.0f} deg/s",
        degrees_from_radians(lines[0].angular_velocity),
        degrees_from_radians(lines[1].angular_velocity), sensor.name,
        degrees_from_radians(sensor.angular_velocity[0]),
        degrees_from_radians(sensor.angular_velocity[1]));
    throw EstimationError(
        clock != 1.0 ? fmt::format("{}: both are {:.4g} times as fast, so the time stamps are in "
                                   "another unit or their clock is wrong",
                                   words, clock)
                     : words + ": wrong sensor, a moving sensor, or a mirrored recording");
  }
  return best;
}

Start find_start(const AngleSeries& head, const sensors::Sensor& sensor,
                 const std::vector<FreeParameter>& free, double angle_noise,
                 std::optional<bool> mirrored) {
  RotorLines found = rotor_lines(head);
  const double step = 1e-9 * static_cast<double>(median_step_ns(head.time_ns));
  double fastest = 0;
  for (const double speed : sensor.angular_velocity) fastest = std::max(fastest, std::abs(speed));
  if (step * fastest > 0.9 * kPi) {
    throw EstimationError(fmt::format(
        "{:.0f} shots per second are too few to follow rotors of {:.0f} deg/s, at least {:.0f} are "
        "needed",
        1.0 / step, degrees_from_radians(fastest), fastest / (0.9 * kPi)));
  }
  const double noise = std::max(angle_noise, radians_from_degrees(1e-4));
  // The shots of the lines, thinned.
  AngleSeries shots;
  const std::size_t stride = std::max<std::size_t>(1, found.shots.size() / kEnoughShots);
  for (std::size_t i = found.shots.begin; i < found.shots.end; i += stride) shots.append(head, i);
  AngleSeries turned = shots;
  mirror(turned);
  RotorLines turned_lines = found;
  for (SpectralLine& line : turned_lines.lines) {
    line.angular_velocity = -line.angular_velocity;
    line.phase = -line.phase;
  }
  const auto start_of = [&](bool image) {
    Start start = image ? start_from(turned, turned_lines, sensor, free, noise)
                        : start_from(shots, found, sensor, free, noise);
    start.mirrored = image;
    return start;
  };
  if (mirrored) return start_of(*mirrored);
  const auto attempt = [&](bool image) -> std::optional<Start> {
    try {
      return start_of(image);
    } catch (const EstimationError&) {  // no combination of the sensor turns like this
      return std::nullopt;
    }
  };
  const double good = good_start_residual(head, angle_noise);
  const std::optional<Start> as_recorded = attempt(false);
  if (as_recorded && as_recorded->residual_rms < good) return *as_recorded;
  const std::optional<Start> other = attempt(true);
  if (other && (!as_recorded || other->residual_rms < good ||
                other->residual_rms < 0.2 * as_recorded->residual_rms)) {
    return *other;
  }
  return as_recorded ? *as_recorded : start_of(false);  // which says why not
}

}  // namespace risley::estimation
