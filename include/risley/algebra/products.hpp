// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

/// @file
/// Products of matrices whose sizes are only known when running. They are compiled here once: the
/// products of Eigen's own expressions take seconds of compilation in every file that has one.
/// All throw InvalidArgument for sizes that do not fit.
namespace risley::algebra {

/// A B
Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// A v
Eigen::VectorXd times(const Eigen::MatrixXd& a, const Eigen::VectorXd& v);
/// A^T B
Eigen::MatrixXd transposed_product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// A^T v
Eigen::VectorXd transposed_times(const Eigen::MatrixXd& a, const Eigen::VectorXd& v);
/// sum += A^T B of the first rows of both
void add_transposed_product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, Eigen::Index rows,
                            Eigen::MatrixXd& sum);

/// J C J^T: covariance of what depends on quantities of covariance C with derivatives J.
Eigen::MatrixXd propagated(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& covariance);
/// J^T H J: normal equations H in the unknowns that those of H depend on with derivatives J.
Eigen::MatrixXd pulled_back(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& hessian);

}  // namespace risley::algebra
