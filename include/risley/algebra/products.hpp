// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

/// @file
/// Products of matrices with sizes known only at run time. They are compiled once here: Eigen's own
/// product expressions take seconds of compilation in every file that uses one. All throw
/// InvalidArgument for sizes that do not fit.
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

/// J C J^T: covariance of functions, with derivatives J, of quantities of covariance C.
Eigen::MatrixXd propagated(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& covariance);
/// J^T H J: normal equations H, transformed to unknowns on which those of H depend with derivatives
/// J.
Eigen::MatrixXd pulled_back(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& hessian);

}  // namespace risley::algebra
