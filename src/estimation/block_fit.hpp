// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "risley/core/angle.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/estimation/rotor_trajectory.hpp"
#include "risley/optics/parameters.hpp"

#include "estimation/knot_model.hpp"

namespace risley::estimation {

/// Sigma, rad/s and rad/s^2, of speeds and accelerations that are not estimated.
inline constexpr double kStraightSigma = 1e-3;

/// Angle, speed and acceleration of every rotor at a time.
struct RotorState {
  std::int64_t time_ns = 0;
  KnotVector<Eigen::Dynamic> mean;
  KnotSquare<Eigen::Dynamic> covariance;
};

/// A start as a state with these sigmas, rad, and those of the speeds from a function, rad/s.
template <class SpeedSigma>
RotorState state_of(const Start& start, double angle_sigma, const SpeedSigma& speed_sigma) {
  const auto prisms = static_cast<Eigen::Index>(start.rotation_angle.size());
  RotorState state;
  state.time_ns = start.time_ns;
  state.mean.setZero(3 * prisms);
  state.covariance.setZero(3 * prisms, 3 * prisms);
  for (Eigen::Index k = 0; k < prisms; ++k) {
    const double speed = start.angular_velocity[static_cast<std::size_t>(k)];
    const double sigma[] = {angle_sigma, speed_sigma(speed), kStraightSigma};
    state.mean[3 * k] = start.rotation_angle[static_cast<std::size_t>(k)];
    state.mean[3 * k + 1] = speed;
    for (Eigen::Index i = 0; i < 3; ++i) {
      state.covariance(3 * k + i, 3 * k + i) = sigma[i] * sigma[i];
    }
  }
  return state;
}

/// A start as a state with these sigmas, rad and a share of the speeds.
inline RotorState loose_state(const Start& start, double angle_sigma, double speed_share) {
  return state_of(start, angle_sigma, [&](double speed) {
    return std::max(speed_share * std::abs(speed), kStraightSigma);
  });
}

/// Moves a state on to a time.
inline void predict(RotorState& state, std::int64_t time_ns,
                    const RotorProcess& process = kSettlingProcess) {
  const double dt = 1e-9 * static_cast<double>(time_ns - state.time_ns);
  state.time_ns = time_ns;
  for (Eigen::Index k = 0; k < state.mean.size(); k += 3) advance_rows(state.mean, k, dt);
  predict_covariance(state.covariance, dt, [&](std::size_t) { return process; });
}

/// One Gauss-Newton step from a state to some shots and a prior together.
/// @param equations  of one knot with these shots, at the state
/// @return false, with the state unchanged, if there is none
inline bool step_towards(const NormalEquations& equations, const RotorState& prior,
                         RotorState& state) {
  const KnotSquare<Eigen::Dynamic> curvature = knot_curvature<Eigen::Dynamic>(equations, 0);
  const KnotVector<Eigen::Dynamic> pull = prior.mean - state.mean;
  KnotSquare<Eigen::Dynamic> covariance = prior.covariance;
  if (!add_information(covariance, curvature)) return false;
  // (P^-1 + H)^-1 (g + P^-1 pull), without P^-1.
  const Eigen::Map<const KnotVector<Eigen::Dynamic>> gradient(equations.gradient.data(),
                                                              pull.size());
  const KnotVector<Eigen::Dynamic> step = pull + covariance * (gradient - curvature * pull);
  if (!step.allFinite()) return false;
  state.mean += step;
  state.covariance = covariance;
  return true;
}

/// A state as a start of other rotors.
inline void set_rotors(Start& start, const RotorState& state) {
  start.time_ns = state.time_ns;
  for (std::size_t k = 0; k < start.rotation_angle.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(3 * k);
    start.rotation_angle[k] = wrap_to_pi(state.mean[at]);
    start.angular_velocity[k] = state.mean[at + 1];
  }
}

/// Typical distance of one shot from the next, rad: the beam's lean times the fastest rotor's step.
inline double usual_step(const Start& start, double rate) {
  double step = 0;
  for (std::size_t k = 0; k < start.angular_velocity.size(); ++k) {
    const int prism = static_cast<int>(k);
    const double leaning = (start.train[place::refractive_index(prism)] - 1.0) *
                           start.train[place::wedge_angle(prism)];
    step = std::max(step, std::abs(leaning * start.angular_velocity[k]) / rate);
  }
  return step;
}

/// A block of shots so short that the rotors move along one parabola in it, and its information on
/// them.
class BlockFit {
 protected:
  BlockFit(const PrismTrain& train, double softening) : train_(train) {
    weights_.softening = softening;
    knot_.prisms = train.prisms();
    knot_.stretch_begin = {0};
    knot_.time_ns.resize(1);
    knot_.first_shot = {0};
    knot_.last_shot.resize(1);
    knot_.state.resize(static_cast<std::size_t>(knot_.states()));
  }

  /// Residuals of the block and its normal equations about a state.
  void evaluate(const RotorState& state) {
    knot_.time_ns[0] = state.time_ns;
    knot_.last_shot[0] = block_.size();
    std::copy_n(state.mean.data(), knot_.state.size(), knot_.state.begin());
    azimuth_.resize(block_.size());
    zenith_.resize(block_.size());
    accumulate(block_, knot_, train_, {}, weights_, equations_, {azimuth_, zenith_, {}});
  }

  /// One Gauss-Newton step from a state to the block and a prior together.
  void improve(RotorState& state, const RotorState& prior) {
    evaluate(state);
    step_towards(equations_, prior, state);
  }

  const PrismTrain& train_;
  AngleSeries block_;
  ShotWeights weights_;
  RotorTrajectory knot_;
  NormalEquations equations_;
  std::vector<double> azimuth_, zenith_;  // residuals of the block, rad
};

}  // namespace risley::estimation
