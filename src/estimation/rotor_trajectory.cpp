// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/rotor_trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/saturating.hpp"
#include "risley/optics/prism.hpp"

namespace risley::estimation {
namespace {

void require_entry(const RotorTrajectory& trajectory, std::size_t knot, std::size_t rotor) {
  require_place("knot", knot, trajectory.covariance.empty() ? 0 : trajectory.size());
  require_place("rotor", rotor, static_cast<std::size_t>(trajectory.prisms));
}

}  // namespace

double RotorTrajectory::covariance_entry(std::size_t knot, std::size_t row,
                                         std::size_t column) const {
  const auto d = static_cast<std::size_t>(states());
  if (row > column) std::swap(row, column);
  return covariance[knot * (d * (d + 1) / 2) + row * d - row * (row + 1) / 2 + column];
}

std::optional<std::size_t> RotorTrajectory::knot_of_shot(std::size_t shot) const {
  const auto after = std::upper_bound(first_shot.begin(), first_shot.end(), shot);
  if (after == first_shot.begin()) return std::nullopt;
  const auto knot = static_cast<std::size_t>(after - first_shot.begin()) - 1;
  if (shot >= last_shot[knot]) return std::nullopt;
  return knot;
}

std::array<double, 5> RotorTrajectory::angle_covariance_terms(std::size_t knot, std::size_t a,
                                                              std::size_t b) const {
  require_entry(*this, knot, std::max(a, b));
  constexpr double kWeight[] = {1.0, 1.0, 0.5};  // of time^0, time^1, time^2 in an angle
  std::array<double, 5> terms{};
  for (std::size_t i = 0; i < kStatesPerRotor; ++i) {
    for (std::size_t j = 0; j < kStatesPerRotor; ++j) {
      terms[i + j] += kWeight[i] * kWeight[j] *
                      covariance_entry(knot, kStatesPerRotor * a + i, kStatesPerRotor * b + j);
    }
  }
  return terms;
}

double RotorTrajectory::angle_covariance(std::size_t knot, std::size_t a, std::size_t b,
                                         double seconds) const {
  return polynomial_at(angle_covariance_terms(knot, a, b), seconds);
}

std::array<double, 3> RotorTrajectory::speed_variance_terms(std::size_t knot,
                                                            std::size_t rotor) const {
  require_entry(*this, knot, rotor);
  const std::size_t speed = kStatesPerRotor * rotor + 1;
  return {covariance_entry(knot, speed, speed), 2.0 * covariance_entry(knot, speed, speed + 1),
          covariance_entry(knot, speed + 1, speed + 1)};
}

RotorTrajectory make_knots(const PackedSeries& series, std::span<const ShotRange> ranges,
                           int prisms, double interval) {
  require_between("number of prisms", prisms, 1, kMaxPrisms);
  require_between("interval", interval, 1e-9, kMostSeconds, "s");
  RotorTrajectory knots;
  knots.prisms = prisms;
  const auto interval_ns = static_cast<std::int64_t>(std::llround(interval * 1e9));
  for (const ShotRange& range : ranges) {
    require_rows("range", range.begin, range.end, series.size());
    if (range.size() == 0) continue;
    knots.stretch_begin.push_back(knots.size());
    const std::int64_t origin = series.time_ns(range.begin);
    for (std::size_t i = range.begin; i < range.end;) {
      const std::int64_t first_ns = series.time_ns(i);
      const std::int64_t slot_end =
          saturating_sum(first_ns - (first_ns - origin) % interval_ns, interval_ns);
      knots.first_shot.push_back(i);
      i = series.first_at({i + 1, range.end}, slot_end);
      const std::int64_t last_ns = series.time_ns(i - 1);
      knots.last_shot.push_back(i);
      knots.time_ns.push_back(first_ns + (last_ns - first_ns) / 2);
    }
  }
  knots.state.assign(knots.size() * static_cast<std::size_t>(knots.states()), 0.0);
  return knots;
}

void interpolate(const RotorTrajectory& from, RotorTrajectory& to) {
  if (from.stretch_begin.size() != to.stretch_begin.size() || from.prisms != to.prisms) {
    throw InvalidArgument(fmt::format(
        "trajectories of {} and {} stretches and of {} and {} rotors, expected the same",
        from.stretch_begin.size(), to.stretch_begin.size(), from.prisms, to.prisms));
  }
  for (std::size_t s = 0; s < to.stretch_begin.size(); ++s) {
    std::size_t near = from.stretch_begin[s];
    const std::size_t last = from.stretch_end(s) - 1;
    for (std::size_t knot = to.stretch_begin[s]; knot < to.stretch_end(s); ++knot) {
      const std::int64_t time = to.time_ns[knot];
      while (near < last &&
             std::llabs(from.time_ns[near + 1] - time) <= std::llabs(from.time_ns[near] - time)) {
        ++near;
      }
      const double seconds = 1e-9 * static_cast<double>(time - from.time_ns[near]);
      const auto state = to.state_of(knot);
      for (std::size_t k = 0; k < static_cast<std::size_t>(to.prisms); ++k) {
        state[kStatesPerRotor * k] = from.angle(near, k, seconds);
        state[kStatesPerRotor * k + 1] = from.speed(near, k, seconds);
        state[kStatesPerRotor * k + 2] = from.state_of(near)[kStatesPerRotor * k + 2];
      }
    }
  }
}

}  // namespace risley::estimation
