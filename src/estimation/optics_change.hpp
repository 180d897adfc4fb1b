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

/// Constants as shots determine them: a posterior mean and its covariance, the prior counted once.
struct ConstantsEstimate {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

/// All pieces together, each of which saw the same constants: information adds up.
/// @param pieces  at least one
ConstantsEstimate pooled(const std::deque<ConstantsEstimate>& pieces, std::size_t newest);

/// By how much the scatter of pieces about their mean exceeds what their covariances say, over the
/// combinations that every piece measures.
struct PieceScatter {
  double variance_factor = 1;     ///< never below 1
  double degrees_of_freedom = 0;  ///< that it was found from
};
PieceScatter piece_scatter(const std::deque<ConstantsEstimate>& pieces);

/// How surprising a difference is where nothing changed.
struct ConstantsDifference {
  double chi2 = 0;       ///< of all combinations
  int combinations = 0;  ///< that both sides measure
  double joint_p_value = 1;
  /// Of each constant, by how much it changed if no other did; NaN if it was not measured.
  Eigen::VectorXd change, change_sigma;
  std::optional<Eigen::Index> constant;  ///< whose change alone explains the difference best
  double single_p_value = 1;             ///< of as good an explanation by any constant
  double p_value = 1;  ///< of either; chance gives a smaller one at most as often as it says
};
/// Compares two independent estimates: all combinations of constants together, and each constant as
/// the only one that changed. Combinations of which the priors say as much as the shots do not
/// count.
/// @param also     covariance of the difference beside that of both estimates
/// @param scatter  multiplies the covariances of both estimates; chi2 then follows F's distribution
ConstantsDifference difference_of(const ConstantsEstimate& a, const ConstantsEstimate& b,
                                  const Eigen::MatrixXd& also, const PieceScatter& scatter);

}  // namespace risley::estimation
