// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "risley/calibration/flight_adjustment.hpp"

namespace risley::calibration {

/// Fit of estimated corrections to their stated process. With x a correction in sigmas of the
/// process, each step between two knots,
///
///     e = (x_next - d x) / sqrt(1 - d^2),   d = exp(-dt / T),
///
/// has a variance of 1 before the flight and v after it. The change due to the flight then has the
/// variance 1 - v, and e / (1 - v) is the best estimate of a jump of the process between the knots.
struct ProcessCheck {
  Eigen::MatrixXd
      score;  ///< [6, knots - 1]: e / sqrt(1 - v); 0 where the flight determines nothing
  Eigen::MatrixXd determined;  ///< [6, knots - 1]: 1 - v
  Eigen::MatrixXd jump;        ///< [6, knots - 1]: a jump that explains it, m and rad
  /// [6]: sums of e^2 over all steps, the first value included, and their expectations.
  Eigen::VectorXd chi2, expected;
};

ProcessCheck check_process(const TrajectoryKnots& knots, const Eigen::MatrixXd& corrections,
                           const FlightPriors& priors, const FlightSystem::Band& band);

/// Jumps of the process: the largest scores beyond the limit, far enough apart that one jump does
/// not count twice. @return knots before them, ascending
std::vector<std::size_t> jumps_of(const TrajectoryKnots& knots, const ProcessCheck& check);

/// Factors [6] on the sigmas of the process required by its corrections, away from jumps; 1 if they
/// fit. If one error is larger than stated, those that the flight hardly determines count as
/// larger, too.
/// @param alerted  the process is known to be larger than stated: smaller misfits are significant
Eigen::VectorXd process_factors(const TrajectoryKnots& knots, const ProcessCheck& check,
                                bool alerted = false);

}  // namespace risley::calibration
