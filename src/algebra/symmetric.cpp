// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/algebra/symmetric.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

#include "risley/algebra/products.hpp"
#include "risley/core/require.hpp"

namespace risley::algebra {
namespace {

/// Smaller eigenvalues of a matrix with a diagonal of ones are rounding.
constexpr double kNoInformation = 1e-13;
/// Share of a combination's square that may lie along directions without information due to
/// rounding.
constexpr double kUntoldShare = 1e-6;

std::size_t length(Eigen::Index size) { return static_cast<std::size_t>(size); }

const Eigen::MatrixXd& checked(const Eigen::MatrixXd& matrix) {
  require_length("columns of a symmetric matrix", length(matrix.cols()), length(matrix.rows()));
  return matrix;
}

}  // namespace

SymmetricSolver::SymmetricSolver(const Eigen::MatrixXd& matrix, double damping)
    : scale_(unit_scale(checked(matrix).diagonal())) {
  require_not_below("damping", damping, 0);
  Eigen::MatrixXd balanced = scaled(matrix, scale_);
  balanced.diagonal().array() += damping;
  factors_.compute(balanced);
  // The factors would give NaN for a direction without information.
  const bool finite = balanced.allFinite();
  if (!finite) scale_.setConstant(std::numeric_limits<double>::quiet_NaN());
  positive_ =
      finite && factors_.info() == Eigen::Success && (factors_.vectorD().array() > 0.0).all();
}

Eigen::VectorXd SymmetricSolver::solve(const Eigen::VectorXd& right) const {
  require_length("right side", length(right.size()), length(scale_.size()));
  const Eigen::VectorXd balanced = scale_.cwiseProduct(right);
  return scale_.cwiseProduct(factors_.solve(balanced).eval());
}

Eigen::MatrixXd SymmetricSolver::solve_columns(const Eigen::MatrixXd& right) const {
  require_length("rows of the right side", length(right.rows()), length(scale_.size()));
  if (right.cols() == 0) return right;  // Eigen would read the first entry of an empty one
  const Eigen::MatrixXd balanced = scale_.asDiagonal() * right;
  return scale_.asDiagonal() * factors_.solve(balanced).eval();
}

Eigen::MatrixXd SymmetricSolver::inverse() const {
  const Eigen::MatrixXd inverse =
      solve_columns(Eigen::MatrixXd::Identity(scale_.size(), scale_.size()));
  return 0.5 * (inverse + inverse.transpose());
}

double SymmetricSolver::chi2(const Eigen::VectorXd& v) const { return v.dot(solve(v)); }

double SymmetricSolver::log_determinant() const {
  if (!positive_) return std::numeric_limits<double>::quiet_NaN();
  return factors_.vectorD().array().log().sum() - 2.0 * scale_.array().log().sum();
}

Eigen::VectorXd unit_scale(const Eigen::VectorXd& diagonal) {
  return diagonal.unaryExpr([](double d) { return d > 0 ? 1.0 / std::sqrt(d) : 1.0; });
}

Eigen::MatrixXd scaled(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& scale) {
  require_length("scale", length(scale.size()), length(checked(matrix).rows()));
  return scale.asDiagonal() * matrix * scale.asDiagonal();
}

PrincipalAxes principal_axes(const Eigen::MatrixXd& matrix) {
  if (checked(matrix).size() == 0) return {};
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& normal, const Eigen::MatrixXd& combinations) {
  const Eigen::VectorXd scale = unit_scale(checked(normal).diagonal());
  require_length("columns of combinations", static_cast<std::size_t>(combinations.cols()),
                 static_cast<std::size_t>(normal.rows()));
  const PrincipalAxes axes = principal_axes(scaled(normal, scale));
  const double least = kNoInformation * static_cast<double>(normal.rows());
  // The part of each combination along every axis.
  const Eigen::MatrixXd along = product(combinations * scale.asDiagonal(), axes.vectors);
  Eigen::MatrixXd scaled = along;
  Eigen::VectorXd untold = Eigen::VectorXd::Zero(combinations.rows());
  for (Eigen::Index i = 0; i < axes.values.size(); ++i) {
    if (axes.values[i] > least) {
      scaled.col(i) /= std::sqrt(axes.values[i]);
    } else {
      scaled.col(i).setZero();
      untold += along.col(i).cwiseAbs2();
    }
  }
  Eigen::MatrixXd covariance = product(scaled, scaled.transpose());
  for (Eigen::Index r = 0; r < covariance.rows(); ++r) {
    if (untold[r] <= kUntoldShare * along.row(r).squaredNorm()) continue;
    covariance.row(r).setZero();
    covariance.col(r).setZero();
    covariance(r, r) = std::numeric_limits<double>::infinity();
  }
  return covariance;
}

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& matrix) {
  const Eigen::VectorXd scale = unit_scale(checked(matrix).diagonal());
  PrincipalAxes axes = principal_axes(scaled(matrix, scale));
  const double least = kNoInformation * static_cast<double>(matrix.rows());
  for (Eigen::Index i = 0; i < axes.values.size(); ++i) {
    axes.vectors.col(i) *= axes.values[i] > least ? 1.0 / std::sqrt(axes.values[i]) : 0.0;
  }
  return scaled(product(axes.vectors, axes.vectors.transpose()), scale);
}

}  // namespace risley::algebra
