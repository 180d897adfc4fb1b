// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/range_fit.hpp"

#include <cmath>

#include <Eigen/Cholesky>

namespace risley::calibration {
namespace {

/// Sines of the smallest angles (0.06 degree) that three points form with each other and their
/// plane with a beam: flatter ones fix no normal, since directions are no better known.
constexpr double kLeastSine = 1e-3;
/// Cosine of the flattest incidence: the predicted range of a flatter one is 10,000 times the
/// distance of the plane.
constexpr double kLeastCosine = 1e-4;
/// Reciprocal condition at which three of a solution's sixteen digits remain.
constexpr double kLeastCondition = 1e-13;

}  // namespace

std::optional<Plane> plane_through(const Beam& a, const Beam& b, const Beam& c) {
  const Vector3<double> corner = a.range * a.direction;
  const Vector3<double> to_b = b.range * b.direction - corner;
  const Vector3<double> to_c = c.range * c.direction - corner;
  const Vector3<double> normal = cross(to_b, to_c);
  const double length = norm(normal);
  if (!(length > kLeastSine * norm(to_b) * norm(to_c))) return std::nullopt;
  Plane plane{(1.0 / length) * normal, 0.0};
  plane.distance = dot(plane.normal, corner);
  if (plane.distance < 0) plane = {-plane.normal, -plane.distance};
  if (!(plane.distance > kLeastSine * a.range)) return std::nullopt;
  return plane;
}

void RangeFit::add(const Beam& beam, double factor) {
  const double cosine = dot(plane_.normal, beam.direction);
  if (!(cosine > kLeastCosine)) return;
  const double predicted = plane_.distance / cosine;
  // Derivative of the range by m is -predicted^2 u; its variance that of the distance / cosine^2.
  const double weight = factor * cosine * cosine / noise_.variance(cosine, beam.range);
  const double slope = predicted * predicted;
  const Eigen::Vector3d u(beam.direction.x, beam.direction.y, beam.direction.z);
  normal_equations_ += (weight * slope * slope) * u * u.transpose();
  right_side_ -= (weight * slope * (beam.range - predicted)) * u;
  ++count_;
}

std::optional<Plane> RangeFit::step() const {
  if (count_ < 3) return std::nullopt;
  const Eigen::LDLT<Eigen::Matrix3d> solver(normal_equations_);
  if (!(solver.rcond() > kLeastCondition)) return std::nullopt;
  const Eigen::Vector3d change = solver.solve(right_side_);
  const Vector3<double> m =
      (1.0 / plane_.distance) * plane_.normal + Vector3<double>{change.x(), change.y(), change.z()};
  const double length = norm(m);
  if (!std::isfinite(length) || !(length > 0)) return std::nullopt;
  return Plane{(1.0 / length) * m, 1.0 / length};
}

}  // namespace risley::calibration
