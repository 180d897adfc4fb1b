// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation/bound.hpp"

#include <cmath>
#include <limits>

#include "risley/algebra/products.hpp"
#include "risley/algebra/symmetric.hpp"

namespace risley::estimation {
namespace {

/// Below this share of the largest, an eigenvalue of the scaled information is due to rounding.
constexpr double kNoInformation = 1e-12;
/// A combination lies across all axes without information when less of its squared length than this
/// is along them: rounding turns them that much.
constexpr double kAcross = 1e-6;

}  // namespace

std::optional<Eigen::MatrixXd> bound_covariance(const Eigen::MatrixXd& information,
                                                const Eigen::VectorXd& scale) {
  const Eigen::Index n = information.rows();
  algebra::PrincipalAxes axes = algebra::principal_axes(algebra::scaled(information, scale));
  if (n > 0 && !(axes.values[0] > kNoInformation * axes.values[n - 1])) return std::nullopt;
  for (Eigen::Index i = 0; i < n; ++i) axes.vectors.row(i) *= scale[i];
  const Eigen::MatrixXd variances = axes.values.cwiseInverse().asDiagonal();
  return algebra::propagated(axes.vectors, variances);
}

double bound_sigma(const Eigen::MatrixXd& information, const Eigen::VectorXd& scale,
                   const Eigen::VectorXd& combination) {
  const Eigen::Index n = information.rows();
  const algebra::PrincipalAxes axes = algebra::principal_axes(algebra::scaled(information, scale));
  const Eigen::VectorXd scaled = combination.cwiseProduct(scale);
  const Eigen::VectorXd along = algebra::transposed_times(axes.vectors, scaled);
  double variance = 0, untold = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (axes.values[i] > kNoInformation * axes.values[n - 1]) {
      variance += along[i] * along[i] / axes.values[i];
    } else {
      untold += along[i] * along[i];
    }
  }
  if (untold > kAcross * scaled.squaredNorm()) return std::numeric_limits<double>::infinity();
  return std::sqrt(variance);
}

}  // namespace risley::estimation
