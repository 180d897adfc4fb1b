// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "calibration/point_noise.hpp"

namespace risley::calibration {

/// Plane through three points, or none when they are nearly on one line or in line with the origin.
std::optional<Plane> plane_through(const Beam& a, const Beam& b, const Beam& c);

/// Sums of a fit of ranges: a plane m . p = 1 is seen along u at the range 1 / (m . u). Ranges are
/// compared, and not distances from the plane, because their noise is then in the residual alone
/// and does not bias the normal.
class RangeFit {
 public:
  RangeFit(const Plane& plane, const PointNoise& noise) : plane_(plane), noise_(noise) {}

  /// @param factor  on the weight of the beam
  void add(const Beam& beam, double factor = 1.0);

  /// The plane after one Gauss-Newton step, or none when the points do not determine one.
  std::optional<Plane> step() const;

 private:
  Plane plane_;
  const PointNoise& noise_;
  Eigen::Matrix3d normal_equations_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side_ = Eigen::Vector3d::Zero();
  std::size_t count_ = 0;
};

}  // namespace risley::calibration
