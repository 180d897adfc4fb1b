// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/rotor_track.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "risley/core/angle.hpp"

#include "estimation/line_fit.hpp"

namespace risley::estimation {
namespace {

/// Half a window of the tracker, s.
constexpr double kTrackStep = 0.025;
constexpr std::size_t kFewestTrackShots = 12;

}  // namespace

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
    if (rows.size() < kFewestTrackShots ||
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
