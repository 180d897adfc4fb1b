// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/solution.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "risley/core/require.hpp"

namespace risley::estimation {
namespace {

/// Fills row of the states from a shot and the knot that serves it.
void fill_state(const Solution& solution, const AngleSeries& series, std::size_t knot,
                std::size_t shot, std::size_t row, RotorStates& states) {
  const RotorTrajectory& t = solution.trajectory;
  double seconds = 1e-9 * static_cast<double>(series.time_ns[shot] - t.time_ns[knot]);
  if (shot < t.first_shot[knot] || shot >= t.last_shot[knot]) {  // of a stretch that was not used
    seconds = std::numeric_limits<double>::quiet_NaN();
  }
  std::size_t entry = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(t.prisms); ++k) {
    states.rotation_angle[k][row] = t.angle(knot, k, seconds);
    states.angular_velocity[k][row] = t.speed(knot, k, seconds);
    states.angular_velocity_sigma[k][row] = std::sqrt(t.speed_variance(knot, k, seconds));
    for (std::size_t l = k; l < static_cast<std::size_t>(t.prisms); ++l) {
      states.rotation_angle_covariance[entry++][row] = t.angle_covariance(knot, k, l, seconds);
    }
  }
  states.time_ns[row] = series.time_ns[shot];
  states.azimuth_residual[row] = solution.azimuth_residual[shot];
  states.zenith_residual[row] = solution.zenith_residual[shot];
  states.outlier[row] = solution.outlier[shot];
}

}  // namespace

RotorStates states_of_shots(const Solution& solution, const AngleSeries& series, ShotRange shots) {
  require_rows("shots", shots.begin, shots.end, series.size());
  const RotorTrajectory& t = solution.trajectory;
  RotorStates states;
  states.resize(t.prisms, shots.size());
  auto knot = static_cast<std::size_t>(
      std::upper_bound(t.first_shot.begin(), t.first_shot.end(), shots.begin) -
      t.first_shot.begin());
  knot = knot > 0 ? knot - 1 : 0;
  for (std::size_t shot = shots.begin; shot < shots.end; ++shot) {
    while (knot + 1 < t.size() && t.first_shot[knot + 1] <= shot) ++knot;
    fill_state(solution, series, knot, shot, shot - shots.begin, states);
  }
  return states;
}

RotorStates states_of_knots(const Solution& solution, const AngleSeries& series) {
  const RotorTrajectory& t = solution.trajectory;
  RotorStates states;
  states.resize(t.prisms, t.size());
  for (std::size_t knot = 0; knot < t.size(); ++knot) {
    const auto begin = series.time_ns.begin();
    const auto first = begin + static_cast<std::ptrdiff_t>(t.first_shot[knot]);
    const auto last = begin + static_cast<std::ptrdiff_t>(t.last_shot[knot]);
    auto shot = static_cast<std::size_t>(std::lower_bound(first, last, t.time_ns[knot]) - begin);
    shot = std::min(shot, t.last_shot[knot] - 1);
    fill_state(solution, series, knot, shot, knot, states);
  }
  return states;
}

}  // namespace risley::estimation
