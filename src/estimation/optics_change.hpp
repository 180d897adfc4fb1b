// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Whether constants have changed between pieces of a recording. Everything is in units of the
// constants' priors: the prior has mean 0 and covariance 1.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace risley::estimation {

/// Constants as determined by shots: a posterior mean and its covariance, the prior counted once.
struct ConstantsEstimate {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

/// All pieces together, which share the same constants: information adds up.
/// @param pieces  at least one
ConstantsEstimate pooled(const std::deque<ConstantsEstimate>& pieces, std::size_t newest);

/// Factor by which the scatter of pieces about their mean exceeds their covariances, over the
/// combinations that every piece measures.
struct PieceScatter {
  double variance_factor = 1;     ///< never below 1
  double degrees_of_freedom = 0;  ///< that it was found from
};
PieceScatter piece_scatter(const std::deque<ConstantsEstimate>& pieces);

/// How improbable a difference is without a change.
struct ConstantsDifference {
  double chi2 = 0;       ///< of all combinations
  int combinations = 0;  ///< that both sides measure
  double joint_p_value = 1;
  /// For each constant, its change if no other changed; NaN if it was not measured.
  Eigen::VectorXd change, change_sigma;
  std::optional<Eigen::Index> constant;  ///< the one whose change alone best explains the
                                         ///< difference
  double single_p_value = 1;             ///< of as good an explanation by any constant
  double p_value = 1;  ///< of either; an upper bound of the frequency of smaller values by chance
};
/// Compares two independent estimates: all combinations of constants together, and each constant as
/// the only one that changed. Combinations known from the priors as well as from the shots are
/// ignored.
/// @param also  covariance of the difference in addition to that of both estimates
/// @param scatter  multiplies the covariances of both estimates; chi2 then follows F's distribution
ConstantsDifference difference_of(const ConstantsEstimate& a, const ConstantsEstimate& b,
                                  const Eigen::MatrixXd& also, const PieceScatter& scatter);

}  // namespace risley::estimation
