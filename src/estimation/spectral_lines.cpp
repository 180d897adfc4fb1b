// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/spectral_lines.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <unsupported/Eigen/FFT>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/golden_section.hpp"

#include "estimation/line_fit.hpp"

namespace risley::estimation {
namespace {

constexpr double kShortest = 0.05;  // s of data that tell the rotors apart
constexpr std::size_t kFewestLineShots = 40;

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

}  // namespace

RotorLines rotor_lines(const AngleSeries& series) {
  if (series.size() < kFewestLineShots || series.duration() < kShortest) {
    throw EstimationError(
        fmt::format("the recording holds {} valid shots over {:.4f} s, at least {} shots over {} s "
                    "are needed to tell the rotors apart",
                    series.size(), series.duration(), kFewestLineShots, kShortest));
  }
  // A short window keeps the drift of the speeds small; slow recordings need a longer one.
  const auto step_ns = static_cast<double>(median_step_ns(series.time_ns));
  RotorLines found;
  found.shots = best_window(series, std::clamp(500 * 1e-9 * step_ns, 0.082, 0.512));
  const std::int64_t first = series.time_ns[found.shots.begin];
  const std::int64_t last = series.time_ns[found.shots.end - 1];
  if (found.shots.size() < kFewestLineShots ||
      static_cast<double>(last - first) < 0.999e9 * kShortest) {
    throw EstimationError(fmt::format(
        "the best {:.4f} s of the recording's start hold {} valid shots, at least {} over {} s are "
        "needed to tell the rotors apart",
        1e-9 * static_cast<double>(last - first), found.shots.size(), kFewestLineShots, kShortest));
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

}  // namespace risley::estimation
