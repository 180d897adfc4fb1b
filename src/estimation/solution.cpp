// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/solution.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "risley/core/angle.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/batch.hpp"

#include "estimation/used_shots.hpp"

namespace risley::estimation {
namespace {

/// The knot whose shots include or precede a shot.
std::size_t knot_before(const RotorTrajectory& trajectory, std::size_t shot) {
  const auto after =
      std::upper_bound(trajectory.first_shot.begin(), trajectory.first_shot.end(), shot);
  const auto knot = static_cast<std::size_t>(after - trajectory.first_shot.begin());
  return knot > 0 ? knot - 1 : 0;
}

double seconds_from(const RotorTrajectory& trajectory, std::size_t knot, std::int64_t time_ns) {
  return 1e-9 * static_cast<double>(time_ns - trajectory.time_ns[knot]);
}

/// Rotation angles of a rotor about a knot, less the turns before it.
struct KnotMotion {
  double angle, speed, acceleration;

  KnotMotion(const RotorTrajectory& trajectory, std::size_t knot, std::size_t rotor) {
    const auto state = trajectory.state_of(knot).subspan(kStatesPerRotor * rotor);
    angle = wrap_to_pi(state[0]);
    speed = state[1];
    acceleration = state[2];
  }
  /// @param seconds  from the knot
  double at(double seconds) const {
    return angle + seconds * (speed + 0.5 * seconds * acceleration);
  }
};

/// Residuals of shots with known rotation angles. @param row_of  the series' row of a shot
template <class RowOf>
ShotResiduals residuals_at(const Solution& solution, const AngleSeries& shots,
                           const std::vector<std::vector<double>>& rotation_angle,
                           const RowOf& row_of) {
  ShotResiduals out;
  out.azimuth.resize(shots.size());
  out.zenith.resize(shots.size());
  if (!solution.azimuth_residual.empty()) {
    for (std::size_t i = 0; i < shots.size(); ++i) {
      out.azimuth[i] = solution.azimuth_residual[row_of(i)];
      out.zenith[i] = solution.zenith_residual[row_of(i)];
    }
    return out;
  }
  const std::vector<std::span<const double>> angles(rotation_angle.begin(), rotation_angle.end());
  DirectionColumns modelled;
  modelled.azimuth = out.azimuth;
  modelled.zenith = out.zenith;
  observe_batch(solution.train, angles, modelled, shots.beam);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const double difference = shots.azimuth[i] - out.azimuth[i];
    out.azimuth[i] = std::abs(difference) <= kPi ? difference : wrap_to_pi(difference);
    out.zenith[i] = shots.zenith[i] - out.zenith[i];
  }
  return out;
}

/// Inputs of rows of the states from the knot of their shots, except residuals.
class KnotStates {
 public:
  KnotStates(const Solution& solution, std::size_t knot)
      : solution_(solution), trajectory_(solution.trajectory), knot_(knot) {
    const auto prisms = static_cast<std::size_t>(trajectory_.prisms);
    std::size_t pair = 0;
    for (std::size_t k = 0; k < prisms; ++k) {
      speed_variance_[k] = trajectory_.speed_variance_terms(knot, k);
      for (std::size_t l = k; l < prisms; ++l) {
        angle_covariance_[pair++] = trajectory_.angle_covariance_terms(knot, k, l);
      }
    }
  }

  void fill(std::int64_t time_ns, std::size_t shot, std::size_t row, RotorStates& states) const {
    double seconds = seconds_from(trajectory_, knot_, time_ns);
    if (shot < trajectory_.first_shot[knot_] || shot >= trajectory_.last_shot[knot_]) {
      seconds = std::numeric_limits<double>::quiet_NaN();  // of a stretch that was not used
    }
    for (std::size_t k = 0; k < states.rotation_angle.size(); ++k) {
      states.rotation_angle[k][row] = trajectory_.angle(knot_, k, seconds);
      states.angular_velocity[k][row] = trajectory_.speed(knot_, k, seconds);
      states.angular_velocity_sigma[k][row] = std::sqrt(polynomial_at(speed_variance_[k], seconds));
    }
    for (std::size_t pair = 0; pair < states.rotation_angle_covariance.size(); ++pair) {
      states.rotation_angle_covariance[pair][row] = polynomial_at(angle_covariance_[pair], seconds);
    }
    states.time_ns[row] = time_ns;
    states.outlier[row] = solution_.outlier[shot];
  }

 private:
  const Solution& solution_;
  const RotorTrajectory& trajectory_;
  std::size_t knot_;
  std::array<std::array<double, 3>, kMaxPrisms> speed_variance_{};
  std::array<std::array<double, 5>, kMaxPrisms*(kMaxPrisms + 1) / 2> angle_covariance_{};
};

}  // namespace

SolvedShots solved_shots(const Solution& solution, const PackedSeries& series, ShotRange shots) {
  require_rows("shots", shots.begin, shots.end, series.size());
  const RotorTrajectory& t = solution.trajectory;
  SolvedShots out;
  series.rows(shots, out.shots);
  out.outlier = std::span(solution.outlier).subspan(shots.begin, shots.size());
  out.rotation_angle.assign(static_cast<std::size_t>(t.prisms), std::vector<double>(shots.size()));
  std::size_t knot = knot_before(t, shots.begin);
  for (std::size_t shot = shots.begin; shot < shots.end;) {
    while (knot + 1 < t.size() && t.first_shot[knot + 1] <= shot) ++knot;
    // Shots up to the knot's last, or, without a knot, up to the next knot's first.
    const bool served = shot >= t.first_shot[knot] && shot < t.last_shot[knot];
    const std::size_t next = shot < t.first_shot[knot] ? t.first_shot[knot]
                             : knot + 1 < t.size()     ? t.first_shot[knot + 1]
                                                       : shots.end;
    const std::size_t end = std::min(shots.end, served ? t.last_shot[knot] : next);
    for (std::size_t k = 0; k < out.rotation_angle.size(); ++k) {
      KnotMotion motion(t, knot, k);
      if (!served) motion.angle = std::numeric_limits<double>::quiet_NaN();
      for (std::size_t i = shot - shots.begin; i < end - shots.begin; ++i) {
        out.rotation_angle[k][i] = motion.at(seconds_from(t, knot, out.shots.time_ns[i]));
      }
    }
    shot = end;
  }
  out.residuals = residuals_at(solution, out.shots, out.rotation_angle,
                               [&](std::size_t i) { return shots.begin + i; });
  return out;
}

ShotResiduals residuals_of_shots(const Solution& solution, const PackedSeries& series,
                                 ShotRange shots) {
  return solved_shots(solution, series, shots).residuals;
}

RotorStates states_of_shots(const Solution& solution, const PackedSeries& series, ShotRange shots) {
  const RotorTrajectory& t = solution.trajectory;
  SolvedShots solved = solved_shots(solution, series, shots);
  RotorStates states;
  states.resize(t.prisms, shots.size());
  for (std::size_t shot = shots.begin; shot < shots.end;) {
    const std::size_t knot = knot_before(t, shot);
    const KnotStates served(solution, knot);
    const std::size_t next = knot + 1 < t.size() ? t.first_shot[knot + 1] : shots.end;
    for (const std::size_t end = std::min(next, shots.end); shot < end; ++shot) {
      const std::size_t row = shot - shots.begin;
      served.fill(solved.shots.time_ns[row], shot, row, states);
    }
  }
  states.azimuth_residual = std::move(solved.residuals.azimuth);
  states.zenith_residual = std::move(solved.residuals.zenith);
  return states;
}

RotorStates states_of_knots(const Solution& solution, const PackedSeries& series) {
  const RotorTrajectory& t = solution.trajectory;
  RotorStates states;
  states.resize(t.prisms, t.size());
  std::vector<std::size_t> shot_of;
  std::vector<std::vector<double>> angles(static_cast<std::size_t>(t.prisms));
  for (std::size_t knot = 0; knot < t.size(); ++knot) {
    // The first shot at or after the knot, or its last.
    const ShotRange own{t.first_shot[knot], t.last_shot[knot]};
    const std::size_t shot = std::min(series.first_at(own, t.time_ns[knot]), own.end - 1);
    const std::int64_t time_ns = series.time_ns(shot);
    KnotStates(solution, knot).fill(time_ns, shot, knot, states);
    for (std::size_t k = 0; k < angles.size(); ++k) {
      angles[k].push_back(KnotMotion(t, knot, k).at(seconds_from(t, knot, time_ns)));
    }
    shot_of.push_back(shot);
  }
  PackedSeries shots;
  shots.append(series, shot_of);
  ShotResiduals residuals =
      residuals_at(solution, shots.rows(), angles, [&](std::size_t knot) { return shot_of[knot]; });
  states.azimuth_residual = std::move(residuals.azimuth);
  states.zenith_residual = std::move(residuals.zenith);
  return states;
}

}  // namespace risley::estimation
