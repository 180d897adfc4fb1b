// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include <Eigen/Core>

namespace risley::estimation {

/// Inverse of an information matrix; none if it is singular.
/// @param scale  sizes of the parameters that make their information comparable
std::optional<Eigen::MatrixXd> bound_covariance(const Eigen::MatrixXd& information,
                                                const Eigen::VectorXd& scale);

/// Sigma of one combination of parameters; infinite if the information does not determine it,
/// though it may determine others.
double bound_sigma(const Eigen::MatrixXd& information, const Eigen::VectorXd& scale,
                   const Eigen::VectorXd& combination);

}  // namespace risley::estimation
