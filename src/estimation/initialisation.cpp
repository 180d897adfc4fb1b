// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/initialisation.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>
#include <fmt/format.h>
#include <unsupported/Eigen/FFT>

#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/optics/observation_model.hpp"

#include "estimation/residual_model.hpp"

namespace risley::estimation {
namespace {

using Complex = std::complex<double>;

constexpr double kShortest = 0.05;  // s of data that tell the rotors apart
constexpr std::size_t kFewestShots = 40;

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

/// The windowed transform of the shots at one angular velocity, whatever their spacing.
Complex transform_at(const std::vector<double>& time, const std::vector<Complex>& value,
                     double angular_velocity) {
  Complex sum = 0;
  for (std::size_t i = 0; i < time.size(); ++i) {
    sum += value[i] * std::polar(1.0, -angular_velocity * time[i]);
  }
  return sum;
}

/// Maximum of the transform's magnitude near a start, by golden section.
double refine_peak(const std::vector<double>& time, const std::vector<Complex>& value, double start,
                   double half_width) {
  const double ratio = 0.5 * (std::sqrt(5.0) - 1.0);
  double a = start - half_width, b = start + half_width;
  double left = b - ratio * (b - a), right = a + ratio * (b - a);
  double power_left = std::norm(transform_at(time, value, left));
  double power_right = std::norm(transform_at(time, value, right));
  for (int i = 0; i < 40; ++i) {
    if (power_left > power_right) {
      b = right;
      right = left;
      power_right = power_left;
      left = b - ratio * (b - a);
      power_left = std::norm(transform_at(time, value, left));
    } else {
      a = left;
      left = right;
      power_left = power_right;
      right = a + ratio * (b - a);
      power_right = std::norm(transform_at(time, value, right));
    }
  }
  return 0.5 * (a + b);
}

/// Least squares over a short window at constant speed: free parameters, angles and speeds.
struct WindowFit {
  Eigen::VectorXd state;  // free parameters, then angle and speed of each rotor at time zero
  double rms = std::numeric_limits<double>::infinity();
};

template <int N>
WindowFit fit_window(const AngleSeries& head, std::size_t first, std::size_t last, double origin,
                     const PrismTrain& train, const std::vector<FreeParameter>& free,
                     Eigen::VectorXd state, bool move_parameters, double noise) {
  const auto statics = static_cast<Eigen::Index>(free.size());
  const Eigen::Index size = statics + 2 * N;
  const Eigen::VectorXd prior = free_values(train, free);
  ResidualModel<N> model(train, free);
  // Many more shots than a start needs would only cost time.
  const std::size_t stride = std::max<std::size_t>(1, (last - first) / 1000);

  const auto evaluate = [&](const Eigen::VectorXd& at, Eigen::MatrixXd* normal,
                            Eigen::VectorXd* gradient, double* squares) {
    model.set(at.head(statics));
    double cost = 0, sum = 0, count = 0;
    if (normal) {
      normal->setZero(size, size);
      gradient->setZero(size);
    }
    const double weight = 1.0 / (noise * noise);
    Eigen::Matrix2Xd row(2, size);
    for (std::size_t i = first; i < last; i += stride) {
      const double t = head.time(i) - origin;
      std::array<double, N> angle;
      for (int k = 0; k < N; ++k) {
        angle[static_cast<std::size_t>(k)] = at[statics + 2 * k] + t * at[statics + 2 * k + 1];
      }
      if (!model.linearise(angle)) {
        cost = std::numeric_limits<double>::infinity();
        break;
      }
      const Eigen::Vector2d residual = model.residual(head.azimuth[i], head.zenith[i]);
      // Huber: gross errors must not carry the start away.
      const double length = residual.norm();
      const double bend = 8.0 * noise + radians_from_degrees(1.0);
      const double share = length <= bend ? 1.0 : bend / length;
      cost += weight * (length <= bend ? length * length : bend * (2.0 * length - bend));
      sum += share * length * length;
      count += 2.0;
      if (normal) {
        row.leftCols(statics) = model.d_parameters();
        for (int k = 0; k < N; ++k) {
          row.col(statics + 2 * k) = model.d_angles().col(k);
          row.col(statics + 2 * k + 1) = t * model.d_angles().col(k);
        }
        *normal += (share * weight) * row.transpose() * row;
        *gradient += (share * weight) * row.transpose() * residual;
      }
    }
    for (Eigen::Index i = 0; i < statics; ++i) {
      const double sigma = free[static_cast<std::size_t>(i)].prior_sigma;
      const double miss = prior[i] - at[i];
      cost += miss * miss / (sigma * sigma);
      if (normal) {
        (*normal)(i, i) += 1.0 / (sigma * sigma);
        (*gradient)[i] += miss / (sigma * sigma);
        if (!move_parameters) (*normal)(i, i) += 1e30;
      }
    }
    if (squares) *squares = std::sqrt(sum / std::max(count, 1.0));
    return cost;
  };

  Eigen::MatrixXd normal;
  Eigen::VectorXd gradient;
  WindowFit fit{std::move(state), 0};
  double damping = 1e-3;
  double cost = evaluate(fit.state, &normal, &gradient, &fit.rms);
  for (int iteration = 0; iteration < 60 && std::isfinite(cost); ++iteration) {
    Eigen::MatrixXd damped = normal;
    damped.diagonal() += damping * normal.diagonal();
    const Eigen::VectorXd step = damped.ldlt().solve(gradient);
    const Eigen::VectorXd trial = fit.state + step;
    const double trial_cost = evaluate(trial, nullptr, nullptr, nullptr);
    if (trial_cost < cost) {
      const bool done = cost - trial_cost < 1e-9 * cost;
      fit.state = trial;
      damping = std::max(damping / 10.0, 1e-12);
      cost = evaluate(fit.state, &normal, &gradient, &fit.rms);
      if (done) break;
    } else {
      damping *= 10.0;
      if (damping > 1e8) break;
    }
  }
  if (!std::isfinite(cost)) fit.rms = std::numeric_limits<double>::infinity();
  return fit;
}

/// Fits ever longer windows around a row, so that a start many degrees off still pulls in.
template <int N>
WindowFit pull_in(const AngleSeries& head, std::size_t row, const sensors::Sensor& sensor,
                  const std::vector<FreeParameter>& free, const std::vector<double>& angle,
                  const std::vector<double>& speed, double noise) {
  const auto statics = static_cast<Eigen::Index>(free.size());
  WindowFit fit;
  fit.state.resize(statics + 2 * N);
  fit.state.head(statics) = free_values(sensor.train, free);
  for (int k = 0; k < N; ++k) {
    fit.state[statics + 2 * k] = angle[static_cast<std::size_t>(k)];
    fit.state[statics + 2 * k + 1] = speed[static_cast<std::size_t>(k)];
  }
  const double origin = head.time(row);
  for (const double half_width : {0.004, 0.012, kStartWindow}) {
    std::size_t first = row, last = row;
    while (first > 0 && origin - head.time(first - 1) <= half_width) --first;
    while (last < head.size() && head.time(last) - origin <= half_width) ++last;
    if (last - first < 8) continue;
    for (const bool move_parameters : {false, true}) {
      if (move_parameters && half_width < 0.02) continue;
      fit = fit_window<N>(head, first, last, origin, sensor.train, free, fit.state, move_parameters,
                          noise);
    }
  }
  return fit;
}

/// Residual, rad, below which a start is taken: behind a good fit only noise, rounding and the
/// wander of the speeds over 0.1 s remain.
double good_start_residual(const AngleSeries& head, double angle_noise) {
  const double rounding = std::sqrt(head.zenith_rounding_variance.front());
  return 1.5 * (angle_noise + rounding) + radians_from_degrees(0.02);
}

}  // namespace

std::vector<SpectralLine> rotor_lines(const AngleSeries& series) {
  if (series.size() < kFewestShots || series.duration() < kShortest) {
    throw EstimationError(
        fmt::format("the recording holds {} valid shots over {:.4f} s, at least {} shots over {} s "
                    "are needed to tell the rotors apart",
                    series.size(), series.duration(), kFewestShots, kShortest));
  }
  // A short window keeps the drift of the speeds small; slow recordings need a longer one.
  const double step_ns = median_step_ns(series, std::min<std::size_t>(series.size(), 20000));
  const double window = std::clamp(500 * 1e-9 * step_ns, 0.082, 0.512);
  std::vector<double> time;
  std::vector<Complex> value;
  const double span = std::min(window, series.duration());  // of the transform, s
  Complex mean = 0;
  std::size_t used = 0;
  for (; used < series.size() && series.time(used) <= span; ++used)
    mean += transverse(series, used);
  mean /= static_cast<double>(used);
  for (std::size_t i = 0; i < used; ++i) {
    const double hann = 0.5 - 0.5 * std::cos(kTwoPi * series.time(i) / span);
    time.push_back(series.time(i));
    value.push_back(hann * (transverse(series, i) - mean));
  }
  // Coarse spectrum on the grid of the shots, four times finer than the window resolves.
  const double step = 1e-9 * step_ns;
  std::size_t bins = 1;
  while (static_cast<double>(bins) < 4.0 * span / step) bins *= 2;
  std::vector<Complex> grid(bins), spectrum;
  for (std::size_t i = 0; i < used; ++i) {
    const auto slot = static_cast<std::size_t>(std::llround(time[i] / step));
    if (slot < bins) grid[slot] += value[i];
  }
  Eigen::FFT<double> fft;
  fft.fwd(spectrum, grid);
  const double bin_speed = kTwoPi / (static_cast<double>(bins) * step);

  std::vector<SpectralLine> lines;
  double weight = 0;
  for (std::size_t i = 0; i < used; ++i) weight += 0.5 - 0.5 * std::cos(kTwoPi * time[i] / span);
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
    const double speed = refine_peak(time, value, signed_bin * bin_speed, 2.0 * bin_speed);
    const Complex sum = transform_at(time, value, speed);
    lines.push_back({speed, std::abs(sum) / weight, std::arg(sum)});
  }
  return lines;
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
  for (const sensors::Sensor& candidate : candidates) {
    for (const auto& order : {std::pair(0, 1), std::pair(1, 0)}) {
      const SpectralLine& a = lines[static_cast<std::size_t>(order.first)];
      const SpectralLine& b = lines[static_cast<std::size_t>(order.second)];
      const auto miss = [&](const SpectralLine& line, std::size_t rotor) {
        return std::abs(line.angular_velocity / candidate.angular_velocity[rotor] - 1.0);
      };
      const double worst = std::max(miss(a, 0), miss(b, 1));
      if (worst < best_miss) {
        best_miss = worst;
        best = {{a, b}, candidate.combination};
      }
    }
  }
  if (best.line.empty()) {
    throw EstimationError(fmt::format(
        "the beam turns at {:.0f} and {:.0f} deg/s, which is no combination of {}'s {:.0f} and "
        "{:.0f} deg/s: wrong sensor, a moving sensor, or a mirrored recording",
        degrees_from_radians(lines[0].angular_velocity),
        degrees_from_radians(lines[1].angular_velocity), sensor.name,
        degrees_from_radians(sensor.angular_velocity[0]),
        degrees_from_radians(sensor.angular_velocity[1])));
  }
  return best;
}

std::size_t zero_position_row(const AngleSeries& series, const PrismTrain& train) {
  const std::vector<double> zeros(static_cast<std::size_t>(train.prisms()), 0.0);
  const Vector3<double> zero = observe(train.without_errors(), zeros).direction;
  std::size_t best = 0;
  double nearest = -2.0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const double near =
        dot(zero, direction_from_angles<double>({series.azimuth[i], series.zenith[i]}));
    if (near > nearest) {
      nearest = near;
      best = i;
    }
  }
  return best;
}

Start find_start(const AngleSeries& head, const sensors::Sensor& sensor,
                 const std::vector<FreeParameter>& free, double angle_noise) {
  const RotorIdentification rotors = identify_rotors(rotor_lines(head), sensor);
  const std::vector<double> speed{rotors.line[0].angular_velocity, rotors.line[1].angular_velocity};
  const double noise = std::max(angle_noise, radians_from_degrees(1e-4));
  const auto statics = static_cast<Eigen::Index>(free.size());

  const std::size_t zero_row = zero_position_row(head, sensor.train);
  WindowFit fit = pull_in<2>(head, zero_row, sensor, free, {0.0, 0.0}, speed, noise);
  const char* method = "zero position";
  // The filter starts at the first shot, so the fit moves there.
  const double back = head.time(0) - head.time(zero_row);
  fit = pull_in<2>(head, 0, sensor, free,
                   {fit.state[statics] + back * fit.state[statics + 1],
                    fit.state[statics + 2] + back * fit.state[statics + 3]},
                   {fit.state[statics + 1], fit.state[statics + 3]}, noise);
  if (!(fit.rms < good_start_residual(head, angle_noise))) {
    // At rotation angle zero the beam leans to -Z, so a line's phase is the angle less 90 degrees.
    const WindowFit by_phase =
        pull_in<2>(head, 0, sensor, free,
                   {rotors.line[0].phase + kPi / 2, rotors.line[1].phase + kPi / 2}, speed, noise);
    if (by_phase.rms < fit.rms) {
      fit = by_phase;
      method = "spectral phases";
    }
  }
  Start start{head.time_ns[0],
              {},
              {},
              with_free_values(sensor.train, free, fit.state.head(statics)),
              rotors.combination,
              method,
              fit.rms};
  for (Eigen::Index k = 0; k < 2; ++k) {
    start.rotation_angle.push_back(fit.state[statics + 2 * k]);
    start.angular_velocity.push_back(fit.state[statics + 2 * k + 1]);
  }
  return start;
}

AngleSeries mirror_image(AngleSeries series) {
  for (double& zenith : series.zenith) zenith = kPi - zenith;
  return series;
}

bool is_mirrored(const AngleSeries& head, const sensors::Sensor& sensor,
                 const std::vector<FreeParameter>& free, double angle_noise) {
  const auto residual = [&](const AngleSeries& shots) {
    try {
      return find_start(shots, sensor, free, angle_noise).residual_rms;
    } catch (const EstimationError&) {  // no combination of the sensor turns like this
      return std::numeric_limits<double>::infinity();
    }
  };
  const double good = good_start_residual(head, angle_noise);
  const double as_recorded = residual(head);
  if (as_recorded < good) return false;
  const double mirrored = residual(mirror_image(head));
  return mirrored < good || mirrored < 0.2 * as_recorded;
}

}  // namespace risley::estimation
