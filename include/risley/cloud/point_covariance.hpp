// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>

#include <Eigen/Core>

#include "risley/cloud/points.hpp"

namespace risley::cloud {

/// Covariance of the own errors of one point, m^2. @param points  with own_covariance
Eigen::Matrix3d own_covariance(const Points& points, std::size_t row);

/// Joint covariance [3 n, 3 n], m^2, of points of a moving sensor, x, y, z of the first one first:
///
///     cov(x_i, x_j) = [i = j] own_i + sum over factors of f_i f_j' + L_i K(t_i, t_j) L_j'
///
/// with the loadings f and the trajectory's errors of L and K. docs/theory/cloud.md, docs/files.md
/// @param points  with own_covariance, and loadings where there are common factors
/// @param errors  of the trajectory, in the axes and the time of the points
/// @param rows    of the points
/// @throws InvalidArgument for rows beyond the points, points without own_covariance, an empty
/// table, times of points outside of it
Eigen::MatrixXd joint_covariance(const Points& points, const TrajectoryErrors& errors,
                                 std::span<const std::size_t> rows);

}  // namespace risley::cloud
