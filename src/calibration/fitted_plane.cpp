// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/fitted_plane.hpp"

#include <algorithm>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

namespace risley::calibration {
namespace {

/// Square of the least width over length of the points: 1 mm at 100 m, and far above rounding.
constexpr double kLeastWidthSquare = 1e-10;

}  // namespace

Plane fitted_plane(std::span<const Vector3<double>> points, std::span<const std::size_t> use) {
  if (use.size() < 3) {
    throw EstimationError(fmt::format("{} points for a plane, at least 3 are needed", use.size()));
  }
  require_place("row", *std::ranges::max_element(use), points.size());
  Vector3<double> middle;
  for (std::size_t i : use) middle += (1.0 / static_cast<double>(use.size())) * points[i];
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (std::size_t i : use) {
    const Vector3<double> p = points[i] - middle;
    const Eigen::Vector3d from_middle(p.x, p.y, p.z);
    moments += from_middle * from_middle.transpose();
  }
  if (!moments.allFinite()) throw EstimationError("the points of a plane are not finite");
  // Squares of the singular values, smallest first.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(moments);
  if (!(axes.eigenvalues()[1] > kLeastWidthSquare * axes.eigenvalues()[2])) {
    throw EstimationError("the points of a plane lie on one line");
  }
  const Eigen::Vector3d normal = axes.eigenvectors().col(0).normalized();
  Plane plane{{normal.x(), normal.y(), normal.z()}, 0.0};
  plane.distance = dot(plane.normal, middle);
  if (plane.distance < 0) plane = {-plane.normal, -plane.distance};
  return plane;
}

}  // namespace risley::calibration
