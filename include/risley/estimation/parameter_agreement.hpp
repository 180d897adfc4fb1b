// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

namespace risley::estimation {

/// Mean chi2 per parameter up to which two sets of parameters count as one sensor's: three sigma in
/// each. The two halves of a real Mid-40's recording are 1.6 apart (docs/real-units.md), two units
/// with errors of a tenth of a degree, each from one second of shots, thousands.
inline constexpr double kMostDisagreement = 9.0;

/// Difference between two sets of the same parameters.
struct Disagreement {
  double chi2_per_parameter = 0;
  Eigen::Index worst = 0;       ///< parameter with the most sigmas
  double worst_over_sigma = 0;  ///< its difference over its sigma, without sign

  /// Whether both sets can be of one sensor; see kMostDisagreement.
  bool same_sensor() const { return chi2_per_parameter <= kMostDisagreement; }
};

/// @param difference  [parameters], at least one
/// @param covariance  of the difference [parameters, parameters]
/// @throws InvalidArgument when their sizes do not match
Disagreement disagreement(const Eigen::VectorXd& difference, const Eigen::MatrixXd& covariance);

}  // namespace risley::estimation
