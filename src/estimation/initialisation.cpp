// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/initialisation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>
#include <fmt/format.h>
#include <unsupported/Eigen/FFT>

#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/golden_section.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/normal_equations.hpp"

#include "estimation/knot_model.hpp"
#include "estimation/residual_model.hpp"

namespace risley::estimation {
namespace {

using Complex = std::complex<double>;

constexpr double kShortest = 0.05;  // s of data that tell the rotors apart
constexpr std::size_t kFewestShots = 40;
/// Shots that refine lines and fit starts; more would only cost time.
constexpr std::size_t kEnoughShots = 1000;
/// Slowest change of a speed that a fit over the first shots leaves to the rotors, rad/s^2.
constexpr double kAccelerationSigma = radians_from_degrees(200.0);
/// Half a window of the tracker, s.
constexpr double kTrackStep = 0.025;
constexpr std::size_t kTrackShots = 12;

/// y + iz of every shot: the transverse part of the unit vector.
Complex transverse(const AngleSeries& series, std::size_t i) {
  const auto v = direction_from_angles<double>({series.azimuth[i], series.zenith[i]});
  return {v.y, v.z};
}

/// Typical time between shots, ns: the median, which gaps do not move.
double median_step_ns(const AngleSeries& series, std::size_t shots) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < shots; ++i)
    steps.push_back(series.time_ns[i] - series.time_ns[i - 1]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return static_cast<double>(*middle);
}

/// Shots of a window as complex numbers with weights.
struct TransverseShots {
  std::vector<double> time, weight;  // s from the reference time
  std::vector<Complex> value;
};

/// A constant and lines of given speeds, fitted to shots: amplitudes, and what stays unexplained.
struct LineFit {
  std::vector<Complex> amplitude;  // constant first
  double unexplained = 0;
};

LineFit fit_lines(const TransverseShots& shots, std::span<const double> speeds) {
  const auto size = static_cast<Eigen::Index>(speeds.size() + 1);
  Eigen::MatrixXcd normal = Eigen::MatrixXcd::Zero(size, size);
  Eigen::VectorXcd right = Eigen::VectorXcd::Zero(size), row(size);
  double total = 0;
  for (std::size_t i = 0; i < shots.time.size(); ++i) {
    row[0] = 1.0;
    for (Eigen::Index k = 1; k < size; ++k) {
      row[k] = std::polar(1.0, -speeds[static_cast<std::size_t>(k - 1)] * shots.time[i]);
    }
    const double weight = shots.weight[i];
    for (Eigen::Index k = 0; k < size; ++k) {
      right[k] += weight * row[k] * shots.value[i];
      for (Eigen::Index l = 0; l <= k; ++l) normal(k, l) += weight * row[k] * std::conj(row[l]);
    }
    total += weight * std::norm(shots.value[i]);
  }
  normal.diagonal().array() += 1e-9 * normal(0, 0);
  normal.triangularView<Eigen::StrictlyUpper>() = normal.adjoint();
  const Eigen::VectorXcd amplitude = normal.ldlt().solve(right);
  return {{amplitude.begin(), amplitude.end()}, total - amplitude.dot(right).real()};
}

/// The stretch of about a window's length that holds most shots; the earliest of similar ones.
ShotRange best_window(const AngleSeries& series, double window) {
  ShotRange best;
  for (double begin = 0;; begin += 0.25 * window) {
    ShotRange range;
    while (range.begin < series.size() && series.time(range.begin) < begin) ++range.begin;
    range.end = range.begin;
    while (range.end < series.size() && series.time(range.end) <= begin + window) ++range.end;
    if (static_cast<double>(range.size()) > 1.2 * static_cast<double>(best.size())) best = range;
    if (begin + window >= series.duration()) return best;
  }
}

/// Shots of rows [begin, end) with a Hann window of weights, thinned.
TransverseShots hann_shots(const AngleSeries& series, ShotRange rows, std::int64_t reference_ns,
                           std::size_t most) {
  TransverseShots shots;
  const double span =
      1e-9 * static_cast<double>(series.time_ns[rows.end - 1] - series.time_ns[rows.begin]);
  const std::size_t stride = std::max<std::size_t>(1, rows.size() / most);
  for (std::size_t i = rows.begin; i < rows.end; i += stride) {
    const double t = 1e-9 * static_cast<double>(series.time_ns[i] - reference_ns);
    shots.time.push_back(t);
    const double u =
        1e-9 * static_cast<double>(series.time_ns[i] - series.time_ns[rows.begin]) / span;
    shots.weight.push_back(0.5 - 0.5 * std::cos(kTwoPi * u) + 1e-3);
    shots.value.push_back(transverse(series, i));
  }
  return shots;
}

/// Speeds of the two strongest lines, to a quarter of what the window resolves.
std::vector<double> coarse_speeds(const AngleSeries& series, ShotRange rows, double step) {
  const TransverseShots shots =
      hann_shots(series, rows, series.time_ns[rows.begin], std::numeric_limits<int>::max());
  Complex mean = 0;
  double weights = 0;
  for (std::size_t i = 0; i < shots.time.size(); ++i) {
    mean += shots.weight[i] * shots.value[i];
    weights += shots.weight[i];
  }
  mean /= weights;
  std::size_t bins = 1;
  while (static_cast<double>(bins) < 4.0 * shots.time.back() / step) bins *= 2;
  std::vector<Complex> grid(bins), spectrum;
  for (std::size_t i = 0; i < shots.time.size(); ++i) {
    const auto slot = static_cast<std::size_t>(std::llround(shots.time[i] / step));
    if (slot < bins) grid[slot] += shots.weight[i] * (shots.value[i] - mean);
  }
  Eigen::FFT<double> fft;
  fft.fwd(spectrum, grid);
  const double bin_speed = kTwoPi / (static_cast<double>(bins) * step);
  std::vector<double> speeds;
  std::vector<bool> taken(bins, false);
  for (int line = 0; line < 2; ++line) {
    std::size_t peak = bins;
    for (std::size_t k = 0; k < bins; ++k) {
      if (!taken[k] && (peak == bins || std::norm(spectrum[k]) > std::norm(spectrum[peak])))
        peak = k;
    }
    // The main lobe of a Hann window is four resolved bins wide, here sixteen.
    for (std::size_t k = 0; k < 33; ++k) taken[(peak + bins + k - 16) % bins] = true;
    const double signed_bin = peak <= bins / 2
                                  ? static_cast<double>(peak)
                                  : static_cast<double>(peak) - static_cast<double>(bins);
    speeds.push_back(signed_bin * bin_speed);
  }
  return speeds;
}

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
      weights.softening = 1.0 / (16.0 * level * level);
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
  start.reach = 1e-9 * static_cast<double>(
                           std::max(found.time_ns - shots.time_ns.front(),
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

RotorLines rotor_lines(const AngleSeries& series) {
  if (series.size() < kFewestShots || series.duration() < kShortest) {
    throw EstimationError(
        fmt::format("the recording holds {} valid shots over {:.4f} s, at least {} shots over {} s "
                    "are needed to tell the rotors apart",
                    series.size(), series.duration(), kFewestShots, kShortest));
  }
  // A short window keeps the drift of the speeds small; slow recordings need a longer one.
  const double step_ns = median_step_ns(series, std::min<std::size_t>(series.size(), 20000));
  RotorLines found;
  found.shots = best_window(series, std::clamp(500 * 1e-9 * step_ns, 0.082, 0.512));
  const std::int64_t first = series.time_ns[found.shots.begin];
  const std::int64_t last = series.time_ns[found.shots.end - 1];
  if (found.shots.size() < kFewestShots ||
      static_cast<double>(last - first) < 0.999e9 * kShortest) {
    throw EstimationError(fmt::format(
        "the best {:.4f} s of the recording's start hold {} valid shots, at least {} over {} s are "
        "needed to tell the rotors apart",
        1e-9 * static_cast<double>(last - first), found.shots.size(), kFewestShots, kShortest));
  }
  found.time_ns = first + (last - first) / 2;
  std::vector<double> speeds = coarse_speeds(series, found.shots, 1e-9 * step_ns);
  // Both lines together, so that neither is bent by the other or by missing shots.
  const TransverseShots shots = hann_shots(series, found.shots, found.time_ns, kEnoughShots);
  double width = kTwoPi / (1e-9 * static_cast<double>(last - first));
  for (int round = 0; round < 2; ++round) {
    for (double& speed : speeds) {
      speed = golden_section_minimum(
          [&](double trial) {
            const double before = std::exchange(speed, trial);
            const double unexplained = fit_lines(shots, speeds).unexplained;
            speed = before;
            return unexplained;
          },
          speed - width, speed + width, 1e-4 * width);
    }
    width *= 0.1;
  }
  const LineFit fit = fit_lines(shots, speeds);
  for (std::size_t k = 0; k < speeds.size(); ++k) {
    found.lines.push_back(
        {speeds[k], std::abs(fit.amplitude[k + 1]), std::arg(fit.amplitude[k + 1])});
  }
  return found;
}

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
  const double step = 1e-9 * median_step_ns(head, std::min<std::size_t>(head.size(), 20000));
  double fastest = 0;
  for (const double speed : sensor.angular_velocity) fastest = std::max(fastest, std::abs(speed));
  if (step * fastest > 0.9 * kPi) {
    throw EstimationError(fmt::format(
        "{:.0f} shots per second are too few to follow rotors of {:.0f} deg/s, at least {:.0f} are "
        "needed",
        1.0 / step, degrees_from_radians(fastest), fastest / (0.9 * kPi)));
  }
  const double noise = std::max(angle_noise, radians_from_degrees(1e-4));
  // The middle part of the window, thinned.
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

void track_rotors(const AngleSeries& series, ShotRange shots, const Start& start,
                  RotorTrajectory& knots, std::size_t first, std::size_t last) {
  struct Point {
    std::int64_t time_ns;
    std::vector<double> angle, speed;
  };
  const auto prisms = static_cast<std::size_t>(knots.prisms);
  const auto step_ns = static_cast<std::int64_t>(kTrackStep * 1e9);
  const auto seconds = [](std::int64_t from, std::int64_t to) {
    return 1e-9 * static_cast<double>(to - from);
  };
  // Phases of the lines near a time, with outliers weighed down once.
  const auto measure = [&](std::int64_t middle, const std::vector<double>& speed,
                           std::vector<double>& angle) {
    const auto begin = series.time_ns.begin();
    const auto from = begin + static_cast<std::ptrdiff_t>(shots.begin);
    const auto to = begin + static_cast<std::ptrdiff_t>(shots.end);
    ShotRange rows{static_cast<std::size_t>(std::lower_bound(from, to, middle - step_ns) - begin),
                   static_cast<std::size_t>(std::upper_bound(from, to, middle + step_ns) - begin)};
    if (rows.size() < kTrackShots ||
        seconds(series.time_ns[rows.begin], series.time_ns[rows.end - 1]) < 0.6 * kTrackStep) {
      return false;
    }
    TransverseShots window = hann_shots(series, rows, middle, kEnoughShots);
    LineFit fit = fit_lines(window, speed);
    std::vector<double> miss(window.time.size());
    for (std::size_t i = 0; i < miss.size(); ++i) {
      Complex expected = fit.amplitude[0];
      for (std::size_t k = 0; k < prisms; ++k) {
        expected += fit.amplitude[k + 1] * std::polar(1.0, speed[k] * window.time[i]);
      }
      miss[i] = std::norm(window.value[i] - expected);
    }
    std::vector<double> sorted = miss;
    std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
    const double limit = 9.0 * sorted[sorted.size() / 2] + 1e-12;
    for (std::size_t i = 0; i < miss.size(); ++i) {
      if (miss[i] > limit) window.weight[i] *= limit / miss[i] * 0.1;
    }
    fit = fit_lines(window, speed);
    angle.resize(prisms);
    for (std::size_t k = 0; k < prisms; ++k) {
      angle[k] = std::arg(fit.amplitude[k + 1]) + start.line_offset[k];
    }
    return true;
  };
  const auto follow = [&](std::int64_t direction) {
    std::vector<Point> points{{start.time_ns, start.rotation_angle, start.angular_velocity}};
    Point now = points.back();
    const std::int64_t end =
        direction > 0 ? series.time_ns[shots.end - 1] : series.time_ns[shots.begin];
    std::vector<double> angle;
    while (direction * (end - now.time_ns) > 0) {
      const double dt = seconds(0, direction * step_ns);
      now.time_ns += direction * step_ns;
      for (std::size_t k = 0; k < prisms; ++k) now.angle[k] += dt * now.speed[k];
      if (!measure(now.time_ns, now.speed, angle)) continue;
      const double since = seconds(points.back().time_ns, now.time_ns);
      for (std::size_t k = 0; k < prisms; ++k) {
        const double miss = wrap_to_pi(angle[k] - now.angle[k]);
        now.angle[k] += 0.8 * miss;
        now.speed[k] += 0.2 * miss / since;
      }
      points.push_back(now);
    }
    if (now.time_ns != points.back().time_ns) points.push_back(now);  // only predicted
    return points;
  };
  std::vector<Point> points = follow(-1);
  std::reverse(points.begin(), points.end());
  const std::vector<Point> ahead = follow(1);
  points.insert(points.end(), ahead.begin() + 1, ahead.end());
  if (points.size() == 1) points.push_back(points.front());
  std::size_t near = 0;
  for (std::size_t knot = first; knot < last; ++knot) {
    const std::int64_t time = knots.time_ns[knot];
    while (near + 2 < points.size() && points[near + 1].time_ns <= time) ++near;
    const Point& a = points[near];
    const Point& b = points[near + 1];
    const double h = seconds(a.time_ns, b.time_ns);
    const double u = h > 0 ? seconds(a.time_ns, time) / h : 0.0;
    const auto state = knots.state_of(knot);
    for (std::size_t k = 0; k < prisms; ++k) {
      if (!(h > 0) || u < 0 || u > 1) {
        const Point& p = u > 1 ? b : a;
        state[3 * k] = p.angle[k] + seconds(p.time_ns, time) * p.speed[k];
        state[3 * k + 1] = p.speed[k];
      } else {  // the straight line between both angles
        state[3 * k] = a.angle[k] + u * (b.angle[k] - a.angle[k]);
        state[3 * k + 1] = (b.angle[k] - a.angle[k]) / h;
      }
      state[3 * k + 2] = 0;
    }
  }
}

}  // namespace risley::estimation
