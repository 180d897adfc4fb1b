// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/algebra/symmetric.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "risley/algebra/products.hpp"

#include "refusal.hpp"

namespace risley::algebra::symmetric_test {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Normal equations of quantities whose units lie 18 orders of magnitude apart.
MatrixXd normal_equations() {
  MatrixXd design(4, 3);
  design << 1, 2e9, 3e-9, 4, -5e9, 6e-9, 7, 8e9, 1e-9, -2, 1e9, 5e-9;
  return design.transpose() * design;
}

TEST(SymmetricSolver, SolvesWhateverTheUnits) {
  const MatrixXd a = normal_equations();
  const VectorXd x = (VectorXd(3) << 1.0, 2e-9, -3e9).finished();
  const SymmetricSolver solver(a);
  EXPECT_TRUE(solver.positive());
  const VectorXd found = solver.solve(times(a, x));
  for (Eigen::Index i = 0; i < 3; ++i) EXPECT_NEAR(found[i] / x[i], 1.0, 1e-12);
  const MatrixXd columns = solver.solve_columns(a);
  EXPECT_NEAR(columns(0, 0), 1.0, 1e-12);
  EXPECT_NEAR(columns(2, 2), 1.0, 1e-12);
  const MatrixXd inverse = solver.inverse();
  EXPECT_EQ(inverse, MatrixXd(inverse.transpose()));
  const VectorXd back = times(inverse, times(a, x));
  for (Eigen::Index i = 0; i < 3; ++i) EXPECT_NEAR(back[i] / x[i], 1.0, 1e-10);
}

TEST(SymmetricSolver, Chi2IsThatOfTheCovariance) {
  MatrixXd covariance(2, 2);
  covariance << 4, 0, 0, 1e-18;
  EXPECT_NEAR(SymmetricSolver(covariance).chi2((VectorXd(2) << 2, 3e-9).finished()), 10.0, 1e-12);
}

TEST(SymmetricSolver, KnowsWhereNothingIsTold) {
  MatrixXd flat = MatrixXd::Ones(2, 2);
  EXPECT_FALSE(SymmetricSolver(flat).positive());
  EXPECT_TRUE(SymmetricSolver(flat, 1e-6).positive());
  flat << 1, 0, 0, 0;
  const SymmetricSolver half(flat);
  EXPECT_FALSE(half.positive());
  EXPECT_EQ(half.solve((VectorXd(2) << 3, 0).finished()), (VectorXd(2) << 3, 0).finished());
  flat << 1, 2, 2, 1;
  EXPECT_FALSE(SymmetricSolver(flat).positive()) << "one eigenvalue is below 0";
  flat(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(SymmetricSolver(flat).positive());
  EXPECT_FALSE(SymmetricSolver(flat).solve(VectorXd::Ones(2)).allFinite());
}

TEST(PrincipalAxes, RebuildTheMatrix) {
  const MatrixXd a = scaled(normal_equations(), unit_scale(normal_equations().diagonal()));
  const PrincipalAxes axes = principal_axes(a);
  EXPECT_LE(axes.values[0], axes.values[1]);
  EXPECT_LE(axes.values[1], axes.values[2]);
  const MatrixXd values = axes.values.asDiagonal();
  EXPECT_LT((propagated(axes.vectors, values) - a).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_EQ(principal_axes(MatrixXd(0, 0)).values.size(), 0);
}

TEST(PseudoInverse, IsTheInverseWhereThereIsOneAndZeroAlongTheRest) {
  const MatrixXd a = normal_equations();
  const MatrixXd difference = pseudo_inverse(a) - SymmetricSolver(a).inverse();
  const VectorXd sigma = SymmetricSolver(a).inverse().diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT(scaled(difference, sigma).cwiseAbs().maxCoeff(), 1e-10);
  // Two unknowns that are only seen as a sum share what is known of it.
  EXPECT_LT(
      (pseudo_inverse(MatrixXd::Ones(2, 2)) - MatrixXd::Constant(2, 2, 0.25)).cwiseAbs().maxCoeff(),
      1e-15);
  EXPECT_EQ(pseudo_inverse(MatrixXd::Zero(2, 2)), MatrixXd(MatrixXd::Zero(2, 2)));
}

TEST(CovarianceOf, WhatNothingTellsHasAnInfiniteVariance) {
  // Unknowns 0 and 1 act only through their sum, 2 alone.
  Eigen::MatrixXd design(4, 3);
  design << 1, 1, 0, 2, 2, 0, 0, 0, 3, 0, 0, 4;
  const Eigen::MatrixXd normal = design.transpose() * design;
  Eigen::MatrixXd combinations(4, 3);
  combinations << 1, 1, 0,  // the sum: 1 / 5
      1, 0, 0,              // one of them: untold
      0, 0, 1,              // 1 / 25
      1, 1, 1;
  const Eigen::MatrixXd covariance = covariance_of(normal, combinations);
  EXPECT_NEAR(covariance(0, 0), 0.2, 1e-14);
  EXPECT_TRUE(std::isinf(covariance(1, 1)));
  EXPECT_EQ(covariance(1, 0), 0);
  EXPECT_NEAR(covariance(2, 2), 0.04, 1e-14);
  EXPECT_NEAR(covariance(3, 3), 0.24, 1e-14);
  EXPECT_NEAR(covariance(3, 0), 0.2, 1e-14);
  EXPECT_NE(refusal([&] { covariance_of(normal, Eigen::MatrixXd::Zero(1, 2)); }).find("columns"),
            std::string::npos);
}

}  // namespace risley::algebra::symmetric_test
