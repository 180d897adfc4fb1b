// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace risley::algebra {

/// Several quantities with their joint covariance.
struct NamedCovariance {
  std::vector<std::string> names;
  Eigen::MatrixXd matrix;  ///< [names, names]

  bool empty() const { return names.empty(); }
  /// Row of a quantity, or -1 if it is not among them.
  Eigen::Index find(std::string_view name) const;
  /// The names of a list that are among them, in the order of the list.
  NamedCovariance part(std::span<const std::string> wanted) const;
};

/// Why a matrix is no covariance.
struct CovarianceFault {
  Eigen::Index row = -1;  ///< row of the defect; -1: in the whole matrix
  std::string words;      ///< to follow the matrix's name
};

/// Checks that a matrix [n, n] of finite numbers has variances above 0 and is symmetric and
/// positive definite, up to rounding in a file.
std::optional<CovarianceFault> covariance_fault(const Eigen::MatrixXd& matrix);

}  // namespace risley::algebra
