// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/spectral_lines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <fmt/format.h>
#include <unsupported/Eigen/FFT>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/golden_section.hpp"

namespace risley::estimation {
namespace {

constexpr std::size_t kFewestLineShots = 40;
/// Shots that lines are refined with; more would only cost time.
constexpr std::size_t kEnoughLineShots = 1000;
/// Steps of the frequency grid per resolved frequency, 1 / duration.
constexpr double kOversampling = 8.0;
/// What holds constant and lines back where shots in a corner of the field tell little of them, as
/// shares of the shots. Lines of higher order, which the fit leaves out, are a tenth of the two.
constexpr double kConstantRidge = 1e-4, kLineRidge = 1e-5;

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

Complex transverse(const AngleSeries& series, std::size_t i) {
  const auto v = direction_from_angles<double>({series.azimuth[i], series.zenith[i]});
  return {v.y, v.z};
}

/// Least squares of a constant and two lines from the sums of their products.
struct Sums {
  double count;
  Complex first, second, difference;                  // sums of exp(i w t)
  Complex constant_value, first_value, second_value;  // of the value times exp(-i w t)
};

std::array<Complex, 3> solve(const Sums& s, double& explained) {
  Eigen::Matrix3cd normal;
  const double n = s.count;
  normal << n * (1.0 + kConstantRidge), s.first, s.second,       //
      std::conj(s.first), n * (1.0 + kLineRidge), s.difference,  //
      std::conj(s.second), std::conj(s.difference), n * (1.0 + kLineRidge);
  const Eigen::Vector3cd right(s.constant_value, s.first_value, s.second_value);
  const Eigen::Vector3cd amplitude = normal.llt().solve(right);
  explained = amplitude.dot(right).real();
  return {amplitude[0], amplitude[1], amplitude[2]};
}

}  // namespace

LineSearch::LineSearch(const AngleSeries& series) {
  if (series.size() < kFewestLineShots || series.duration() < kShortestStart) {
    throw EstimationError(
        fmt::format("the recording holds {} valid shots over {:.4f} s, at least {} shots over {} s "
                    "are needed to tell the rotors apart",
                    series.size(), series.duration(), kFewestLineShots, kShortestStart));
  }
  // A short window keeps the drift of the speeds small; slow recordings need a longer one.
  const auto step_ns = median_step_ns(series.time_ns);
  const double step = 1e-9 * static_cast<double>(step_ns);
  shots_ = best_window(series, std::clamp(500 * step, 0.1, 0.512));
  const std::int64_t first = series.time_ns[shots_.begin];
  const std::int64_t last = series.time_ns[shots_.end - 1];
  duration_ = 1e-9 * static_cast<double>(last - first);
  if (shots_.size() < kFewestLineShots || duration_ < 0.999 * kShortestStart) {
    throw EstimationError(fmt::format(
        "the best {:.4f} s of the recording's start hold {} valid shots, at least {} over {} s are "
        "needed to tell the rotors apart",
        duration_, shots_.size(), kFewestLineShots, kShortestStart));
  }
  time_ns_ = first + (last - first) / 2;
  std::size_t bins = 1;
  while (static_cast<double>(bins) < kOversampling * duration_ / step) bins *= 2;
  bin_speed_ = kTwoPi / (static_cast<double>(bins) * step);
  std::vector<Complex> shot_grid(bins), value_grid(bins);
  const std::size_t stride = std::max<std::size_t>(1, shots_.size() / kEnoughLineShots);
  for (std::size_t i = shots_.begin; i < shots_.end; ++i) {
    const Complex value = transverse(series, i);
    const auto slot = static_cast<std::size_t>((series.time_ns[i] - first + step_ns / 2) / step_ns);
    shot_grid[slot % bins] += 1.0;
    value_grid[slot % bins] += value;
    count_ += 1.0;
    power_ += std::norm(value);
    if ((i - shots_.begin) % stride != 0) continue;
    time_.push_back(1e-9 * static_cast<double>(series.time_ns[i] - time_ns_));
    value_.push_back(value);
  }
  Eigen::FFT<double> fft;
  fft.fwd(shot_spectrum_, shot_grid);
  fft.fwd(value_spectrum_, value_grid);
}

Complex LineSearch::sum_at(const std::vector<Complex>& spectrum, std::ptrdiff_t bin) const {
  const auto bins = static_cast<std::ptrdiff_t>(spectrum.size());
  return spectrum[static_cast<std::size_t>(((bin % bins) + bins) % bins)];
}

/// Times count from the first shot here, which turns amplitudes but changes no sum of squares.
double LineSearch::unexplained(std::ptrdiff_t first, std::ptrdiff_t second) const {
  const Sums sums{count_,
                  std::conj(sum_at(shot_spectrum_, first)),
                  std::conj(sum_at(shot_spectrum_, second)),
                  std::conj(sum_at(shot_spectrum_, second - first)),
                  sum_at(value_spectrum_, 0),
                  sum_at(value_spectrum_, first),
                  sum_at(value_spectrum_, second)};
  double explained = 0;
  solve(sums, explained);
  return (power_ - explained) / count_;
}

RotorLines LineSearch::fit(double first, double second) const {
  Sums sums{static_cast<double>(time_.size()), 0, 0, 0, 0, 0, 0};
  double power = 0;
  for (std::size_t i = 0; i < time_.size(); ++i) {
    const Complex a = std::polar(1.0, first * time_[i]), b = std::polar(1.0, second * time_[i]);
    sums.first += a;
    sums.second += b;
    sums.difference += std::conj(a) * b;
    sums.constant_value += value_[i];
    sums.first_value += std::conj(a) * value_[i];
    sums.second_value += std::conj(b) * value_[i];
    power += std::norm(value_[i]);
  }
  double explained = 0;
  const auto amplitude = solve(sums, explained);
  RotorLines result;
  result.constant = amplitude[0];
  result.lines = {{first, std::abs(amplitude[1]), std::arg(amplitude[1])},
                  {second, std::abs(amplitude[2]), std::arg(amplitude[2])}};
  result.unexplained = (power - explained) / static_cast<double>(time_.size());
  return result;
}

RotorLines LineSearch::refined(const Candidate& candidate) const {
  std::array<double, 2> speeds = {bin_speed_ * static_cast<double>(candidate.first),
                                  bin_speed_ * static_cast<double>(candidate.second)};
  double width = bin_speed_;
  for (int round = 0; round < 3; ++round, width *= 0.3) {
    for (double& speed : speeds) {
      speed = golden_section_minimum(
          [&](double trial) {
            const double before = std::exchange(speed, trial);
            const double left = fit(speeds[0], speeds[1]).unexplained;
            speed = before;
            return left;
          },
          speed - width, speed + width, 0.02 * width);
    }
  }
  return fit(speeds[0], speeds[1]);
}

LineSearch::Bins LineSearch::bins_about(double speed, double share) const {
  const double low = std::min(speed * (1 - share), speed * (1 + share));
  const double high = std::max(speed * (1 - share), speed * (1 + share));
  return {static_cast<std::ptrdiff_t>(std::floor(low / bin_speed_)),
          static_cast<std::ptrdiff_t>(std::ceil(high / bin_speed_))};
}

std::vector<RotorLines> LineSearch::near(const std::pair<double, double>& speeds, double share,
                                         std::size_t most) const {
  return best_of(bins_about(speeds.first, share), bins_about(speeds.second, share), false, most);
}

std::vector<RotorLines> LineSearch::anywhere(double fastest, std::size_t most) const {
  const auto edge = static_cast<std::ptrdiff_t>(std::ceil(fastest / bin_speed_));
  return best_of({-edge, edge}, {-edge, edge}, true, most);
}

std::vector<RotorLines> LineSearch::best_of(Bins first, Bins second, bool ordered,
                                            std::size_t most) const {
  constexpr std::ptrdiff_t kApart = 4;  // bins: lines nearer to each other or to 0 are one line
  std::vector<Candidate> all;
  for (std::ptrdiff_t a = first.first; a <= first.last; ++a) {
    if (std::abs(a) < kApart) continue;
    for (std::ptrdiff_t b = ordered ? a + kApart : second.first; b <= second.last; ++b) {
      if (std::abs(b) < kApart || std::abs(a - b) < kApart) continue;
      all.push_back({a, b, unexplained(a, b)});
    }
  }
  std::vector<RotorLines> best;
  std::vector<Candidate> taken;
  while (best.size() < most) {
    const Candidate* next = nullptr;
    for (const Candidate& candidate : all) {
      if (next != nullptr && candidate.unexplained >= next->unexplained) continue;
      const bool known = std::any_of(taken.begin(), taken.end(), [&](const Candidate& other) {
        return std::abs(candidate.first - other.first) <= kApart &&
               std::abs(candidate.second - other.second) <= kApart;
      });
      if (!known) next = &candidate;
    }
    if (next == nullptr) break;
    taken.push_back(*next);
    best.push_back(refined(*next));
  }
  std::stable_sort(best.begin(), best.end(), [](const RotorLines& a, const RotorLines& b) {
    return a.unexplained < b.unexplained;
  });
  return best;
}

}  // namespace risley::estimation
