// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "risley/calibration/flight_adjustment.hpp"

namespace risley::calibration {

/// How corrections that were found fit the process that is stated of them. With x a correction in
/// sigmas of the process, each step between two knots,
///
///     e = (x_next - d x) / sqrt(1 - d^2),   d = exp(-dt / T),
///
/// has a variance of 1 before the flight and v after it. What the flight moved it by then has the
/// variance 1 - v, and e / (1 - v) is the best estimate of a jump of the process between the knots.
struct ProcessCheck {
  Eigen::MatrixXd
      score;             ///< [6, knots - 1]: e / sqrt(1 - v); 0 where the flight determines nothing
  Eigen::MatrixXd told;  ///< [6, knots - 1]: 1 - v
  Eigen::MatrixXd jump;  ///< [6, knots - 1]: a jump that explains it, m and rad
  /// [6]: sums of e^2 over all steps, the first value included, and what is expected of them.
  Eigen::VectorXd chi2, expected;
};

ProcessCheck check_process(const TrajectoryKnots& knots, const Eigen::MatrixXd& corrections,
                           const FlightPriors& priors, const FlightSystem::Band& band);

/// Where the process jumps: the largest scores beyond the limit, far enough from each other that
/// one jump does not count twice. @return knots before them, ascending
std::vector<std::size_t> jumps_of(const TrajectoryKnots& knots, const ProcessCheck& check);

/// Factors [6] on the sigmas of the process that its corrections ask for, away from jumps; 1 where
/// they fit. Where one error is larger than stated, those that the flight hardly determines count
/// as larger, too.
/// @param alerted  the process is known to be larger than stated: smaller misfits count
Eigen::VectorXd process_factors(const TrajectoryKnots& knots, const ProcessCheck& check,
                                bool alerted = false);

}  // namespace risley::calibration
