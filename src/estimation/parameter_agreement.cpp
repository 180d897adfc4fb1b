// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/parameter_agreement.hpp"

#include <fmt/format.h>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/error.hpp"

namespace risley::estimation {

Disagreement disagreement(const Eigen::VectorXd& difference, const Eigen::MatrixXd& covariance) {
  const Eigen::Index n = difference.size();
  if (n == 0 || covariance.rows() != n || covariance.cols() != n) {
    throw InvalidArgument(
        fmt::format("{} differences with a covariance of {} by {}, expected one or more and as "
                    "many rows and columns",
                    n, covariance.rows(), covariance.cols()));
  }
  Disagreement result;
  result.chi2_per_parameter =
      algebra::SymmetricSolver(covariance).chi2(difference) / static_cast<double>(n);
  result.worst_over_sigma = difference.cwiseAbs()
                                .cwiseQuotient(covariance.diagonal().cwiseSqrt())
                                .maxCoeff(&result.worst);
  return result;
}

}  // namespace risley::estimation
