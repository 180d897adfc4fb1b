// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/algebra/named_covariance.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/algebra/symmetric.hpp"

namespace risley::algebra {

using Eigen::Index;

Index NamedCovariance::find(std::string_view name) const {
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? -1 : static_cast<Index>(at - names.begin());
}

NamedCovariance NamedCovariance::part(std::span<const std::string> wanted) const {
  NamedCovariance result;
  std::vector<Index> rows;
  for (const std::string& name : wanted) {
    const Index row = find(name);
    if (row < 0) continue;
    result.names.push_back(name);
    rows.push_back(row);
  }
  result.matrix = matrix(rows, rows);
  return result;
}

std::optional<CovarianceFault> covariance_fault(const Eigen::MatrixXd& matrix) {
  // Rounding tolerance: share of two sigmas by which two halves differ, and an eigenvalue of
  // correlations.
  constexpr double kAsymmetry = 1e-12, kLeastEigenvalue = -1e-9;
  for (Index i = 0; i < matrix.rows(); ++i) {
    if (!(matrix(i, i) > 0.0)) {
      return CovarianceFault{i, fmt::format("[{0}][{0}]: a variance must be above 0", i)};
    }
    for (Index j = 0; j < i; ++j) {
      if (std::abs(matrix(i, j) - matrix(j, i)) >
          kAsymmetry * std::sqrt(matrix(i, i) * matrix(j, j))) {
        return CovarianceFault{
            i, fmt::format(" is not symmetric: [{0}][{1}] differs from [{1}][{0}]", i, j)};
      }
    }
  }
  if (matrix.size() == 0) return std::nullopt;
  const Eigen::VectorXd over_sigma = matrix.diagonal().cwiseSqrt().cwiseInverse();
  const double smallest = principal_axes(scaled(matrix, over_sigma)).values.minCoeff();
  if (smallest >= kLeastEigenvalue) return std::nullopt;
  return CovarianceFault{
      -1, fmt::format(" is not positive: the smallest eigenvalue of its correlations is {:.3g}, "
                      "allowed 0 and above",
                      smallest)};
}

}  // namespace risley::algebra
