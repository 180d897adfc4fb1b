// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/emitters_in_turn.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>

#include "risley/core/angle.hpp"
#include "risley/core/median.hpp"

namespace risley::estimation {
namespace {

/// Angles between shots that are a number of rows apart, rad.
std::vector<double> steps_over(const CountedShots& shots, std::size_t rows) {
  constexpr std::size_t kMost = 100'000;
  std::vector<double> steps;
  for (std::size_t i = 0, next = 0; i < shots.rows.size() && steps.size() < kMost; ++i) {
    while (next < shots.rows.size() && shots.rows[next] < shots.rows[i] + rows) ++next;
    if (next == shots.rows.size() || shots.rows[next] != shots.rows[i] + rows) continue;
    const AngleSeries& s = shots.series;
    const double azimuth = std::remainder(s.azimuth[next] - s.azimuth[i], kTwoPi);
    steps.push_back(std::hypot(azimuth * std::sin(s.zenith[i]), s.zenith[next] - s.zenith[i]));
  }
  return steps;
}

}  // namespace

int emitters_in_turn(const CountedShots& shots) {
  constexpr double kSmoother = 1.5;
  std::vector<double> neighbours = steps_over(shots, 1);
  const double usual = median(neighbours);
  for (const int emitters : {4, 6}) {
    std::vector<double> steps = steps_over(shots, static_cast<std::size_t>(emitters));
    if (median(steps) < kSmoother * usual) return emitters;
  }
  return 1;
}

double rows_between_jumps(const CountedShots& shots, int emitters) {
  constexpr std::size_t kFewest = 500, kMost = 100'000;
  // Changes of the step from shot to shot: share of the usual step, and multiples of the usual
  // change and of the rounding error. Beams that turn smoothly change it by some per cent.
  constexpr double kChange = 0.5, kUsualChanges = 6.0, kRounding = 5.0;
  const auto turn = static_cast<std::size_t>(std::max(emitters, 1));
  const AngleSeries& s = shots.series;
  const auto step = [&s](std::size_t from, std::size_t to) {
    const double azimuth = std::remainder(s.azimuth[to] - s.azimuth[from], kTwoPi);
    return Eigen::Vector2d(azimuth * std::sin(s.zenith[from]), s.zenith[to] - s.zenith[from]);
  };
  std::vector<double> steps, changes, roundings;
  std::size_t next = 0, last = 0;
  const auto find = [&](std::size_t row, std::size_t& place) {
    while (place < shots.rows.size() && shots.rows[place] < row) ++place;
    return place < shots.rows.size() && shots.rows[place] == row;
  };
  for (std::size_t i = 0; i < shots.rows.size() && steps.size() < kMost; ++i) {
    if (!find(shots.rows[i] + turn, next) || !find(shots.rows[i] + 2 * turn, last)) continue;
    const Eigen::Vector2d one = step(i, next), other = step(next, last);
    steps.push_back(one.norm());
    changes.push_back((other - one).norm());
    roundings.push_back(std::sqrt(6.0 * static_cast<double>(s.zenith_rounding_variance[next])));
  }
  if (steps.size() < kFewest) return std::numeric_limits<double>::infinity();
  std::vector<double> sorted = changes;
  const double limit = std::max(kChange * median(steps), kUsualChanges * median(sorted));
  double jumps = 0;  // each is seen from both sides, by every emitter
  for (std::size_t i = 0; i < changes.size(); ++i) {
    jumps += changes[i] > std::max(limit, kRounding * roundings[i]) ? 0.5 : 0.0;
  }
  return static_cast<double>(changes.size() * turn) / jumps;
}

}  // namespace risley::estimation
