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

/// Some quantities with their joint covariance.
struct NamedCovariance {
  std::vector<std::string> names;
  Eigen::MatrixXd matrix;  ///< [names, names]

  bool empty() const { return names.empty(); }
  /// Row of a quantity, or -1 where it is not among them.
  Eigen::Index find(std::string_view name) const;
  /// Those of a list that are among them, in the order of the list.
  NamedCovariance part(std::span<const std::string> wanted) const;
};

/// Why a matrix is no covariance.
struct CovarianceFault {
  Eigen::Index row = -1;  ///< where it shows; -1: in all of it
  std::string words;      ///< to follow the matrix's name
};

/// Looks whether a matrix [n, n] of finite numbers has variances above 0, is symmetric and
/// positive, but for what rounding in a file does.
std::optional<CovarianceFault> covariance_fault(const Eigen::MatrixXd& matrix);

}  // namespace risley::algebra
