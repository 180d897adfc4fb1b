// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace risley::algebra {

/// Factors of a symmetric matrix A, such as normal equations or a covariance. A is scaled to a
/// diagonal of ones before it is factorised (LDL^T with pivoting), since unknowns of one system
/// differ by many orders of magnitude.
class SymmetricSolver {
 public:
  /// @param matrix  [n, n], only the lower triangle is read
  /// @param damping  added to the diagonal of ones
  /// @throws InvalidArgument for a matrix that is not square or a damping below 0
  explicit SymmetricSolver(const Eigen::MatrixXd& matrix, double damping = 0);

  /// Whether all pivots are above 0 and finite: every direction has information.
  bool positive() const { return positive_; }

  /// x of A x = b. Directions without information come out as zero, and NaN as NaN.
  /// @throws InvalidArgument for another number of rows than n
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const;
  /// The same for every column of b.
  Eigen::MatrixXd solve_columns(const Eigen::MatrixXd& right) const;
  /// A^-1, exactly symmetric.
  Eigen::MatrixXd inverse() const;
  /// v^T A^-1 v: squared length of v in sigmas when A is its covariance.
  double chi2(const Eigen::VectorXd& v) const;
  /// Log of the determinant of A, damping included; NaN unless positive().
  double log_determinant() const;

 private:
  Eigen::VectorXd scale_;
  Eigen::LDLT<Eigen::MatrixXd> factors_;  ///< of the scaled matrix
  bool positive_ = false;
};

/// 1 / sqrt of the elements, which scales a matrix with this diagonal to ones; 1 where an element
/// is not above 0.
Eigen::VectorXd unit_scale(const Eigen::VectorXd& diagonal);

/// diag(s) A diag(s)
/// @throws InvalidArgument for lengths that do not fit
Eigen::MatrixXd scaled(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& scale);

/// Eigenvalues, smallest first, and their unit eigenvectors as columns.
struct PrincipalAxes {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};

/// @param matrix  symmetric [n, n], only the lower triangle is read
/// @throws InvalidArgument for a matrix that is not square
PrincipalAxes principal_axes(const Eigen::MatrixXd& matrix);

/// Inverse of normal equations in which some directions may have no information; it is zero along
/// these. Pivots below a ten-trillionth of the unit diagonal count as rounding.
/// @param matrix  symmetric [n, n], positive or semidefinite
/// @throws InvalidArgument for a matrix that is not square
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& matrix);

/// Covariance [rows, rows] of linear combinations of unknowns, from the unknowns' normal equations.
/// A combination that includes a direction without information has an infinite variance, and
/// covariances of 0.
/// @param normal        as for pseudo_inverse [n, n]
/// @param combinations  [rows, n]
/// @throws InvalidArgument for a matrix that is not square, combinations of another width
Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& normal, const Eigen::MatrixXd& combinations);

}  // namespace risley::algebra
