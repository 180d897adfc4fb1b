// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/algebra/products.hpp"

#include <string_view>

#include "risley/core/require.hpp"

namespace risley::algebra {
namespace {

void require_fit(std::string_view name, Eigen::Index size, Eigen::Index expected) {
  require_length(name, static_cast<std::size_t>(size), static_cast<std::size_t>(expected));
}

}  // namespace

Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  require_fit("rows of the second factor", b.rows(), a.cols());
  return a * b;
}

Eigen::VectorXd times(const Eigen::MatrixXd& a, const Eigen::VectorXd& v) {
  require_fit("rows of the second factor", v.size(), a.cols());
  return a * v;
}

Eigen::MatrixXd transposed_product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  require_fit("rows of the second factor", b.rows(), a.rows());
  return a.transpose() * b;
}

Eigen::VectorXd transposed_times(const Eigen::MatrixXd& a, const Eigen::VectorXd& v) {
  require_fit("rows of the second factor", v.size(), a.rows());
  return a.transpose() * v;
}

void add_transposed_product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, Eigen::Index rows,
                            Eigen::MatrixXd& sum) {
  require_rows("rows", 0, static_cast<std::size_t>(rows), static_cast<std::size_t>(a.rows()));
  require_fit("rows of the second factor", b.rows(), a.rows());
  require_fit("rows of the sum", sum.rows(), a.cols());
  require_fit("columns of the sum", sum.cols(), b.cols());
  sum.noalias() += a.topRows(rows).transpose() * b.topRows(rows);
}

Eigen::MatrixXd propagated(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& covariance) {
  require_fit("rows of the covariance", covariance.rows(), jacobian.cols());
  require_fit("columns of the covariance", covariance.cols(), jacobian.cols());
  const Eigen::MatrixXd half = jacobian * covariance;
  return half * jacobian.transpose();
}

Eigen::MatrixXd pulled_back(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& hessian) {
  require_fit("rows of the normal equations", hessian.rows(), jacobian.rows());
  require_fit("columns of the normal equations", hessian.cols(), jacobian.rows());
  const Eigen::MatrixXd half = jacobian.transpose() * hessian;
  return half * jacobian;
}

}  // namespace risley::algebra
