// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "risley/estimation/normal_equations.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/estimation/rotor_trajectory.hpp"

namespace risley::estimation {

/// Prior of the parameters, about the linearisation point.
struct ParameterPrior {
  Eigen::VectorXd information;  ///< [free], 1 / sigma^2
  Eigen::VectorXd gradient;     ///< [free], information times (prior mean minus linearisation)
};

/// The minimum of all terms together: shots, process noise, prior.
struct SmootherSolution {
  Eigen::VectorXd parameter_step;         ///< [free]
  Eigen::MatrixXd parameter_covariance;   ///< [free, free], prior included
  Eigen::MatrixXd parameter_information;  ///< [free, free], of the data alone, rotors eliminated
  std::vector<double> state_step;         ///< [knots][prisms][3]
  /// Only with covariances: joint covariance of each knot's states as in RotorTrajectory, and, knot
  /// by knot, the smoothed states at unchanged parameters and their derivatives by the parameters
  /// [free + 1][d].
  std::vector<double> state_covariance, affine_states;

  /// Derivatives of a knot's smoothed states by the parameters [d, free]. @param d  as states()
  Eigen::Map<const Eigen::MatrixXd> sensitivity(std::size_t knot, Eigen::Index d) const {
    const Eigen::Index free = parameter_step.size();
    return {affine_states.data() + knot * static_cast<std::size_t>(d * (free + 1)) + d, d, free};
  }
};

/// One Gauss-Newton step of the whole trajectory. The parameters are constants without noise, so
/// the states of every knot are affine functions of them: a forward pass over the knots carries
/// mean, derivative and covariance of the rotor states and collects the information on the
/// parameters; a backward pass propagates information from later knots to earlier ones (as
/// information if covariances are needed, otherwise in the faster form of Bryson and Frazier).
/// Equal to the solution of the full normal equations at a cost proportional to the number of
/// knots. Derivation: docs/theory/map.md
/// @param linearisation  the trajectory the equations were accumulated at
/// @param process        [prisms]
/// @param covariances  whether to compute the covariances of the states
/// @throws EstimationError when a covariance is no longer positive definite (place in the message)
SmootherSolution smooth(const NormalEquations& equations, const RotorTrajectory& linearisation,
                        std::span<const RotorProcess> process, const ParameterPrior& prior,
                        bool covariances);

}  // namespace risley::estimation
