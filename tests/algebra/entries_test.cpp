// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the entries of the layer refuse, and that they say what would be right.
#include <gtest/gtest.h>

#include "risley/algebra/products.hpp"
#include "risley/algebra/symmetric.hpp"

#include "refusal.hpp"

namespace risley::algebra::entries_test {

using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(AlgebraEntries, SizesThatDoNotFitAreRefused) {
  const MatrixXd wide(2, 3), square = MatrixXd::Identity(2, 2);
  const VectorXd three = VectorXd::Ones(3);
  MatrixXd sum = MatrixXd::Zero(2, 2);
  const auto refused = [](const auto& call, const char* message) {
    EXPECT_EQ(refusal(call), message);
  };
  refused([&] { SymmetricSolver{wide}; }, "columns of a symmetric matrix has 3 values, expected 2");
  refused([&] { SymmetricSolver(square, -1.0); }, "damping = -1, allowed 0 and above");
  refused([&] { SymmetricSolver(square).solve(three); }, "right side has 3 values, expected 2");
  refused([&] { SymmetricSolver(square).solve_columns(MatrixXd(3, 1)); },
          "rows of the right side has 3 values, expected 2");
  refused([&] { scaled(square, three); }, "scale has 3 values, expected 2");
  refused([&] { principal_axes(wide); }, "columns of a symmetric matrix has 3 values, expected 2");
  refused([&] { pseudo_inverse(wide); }, "columns of a symmetric matrix has 3 values, expected 2");
  refused([&] { product(wide, square); }, "rows of the second factor has 2 values, expected 3");
  refused([&] { times(square, three); }, "rows of the second factor has 3 values, expected 2");
  refused([&] { transposed_product(MatrixXd(3, 1), square); },
          "rows of the second factor has 2 values, expected 3");
  refused([&] { transposed_times(square, three); },
          "rows of the second factor has 3 values, expected 2");
  refused([&] { propagated(wide, square); }, "rows of the covariance has 2 values, expected 3");
  refused([&] { pulled_back(MatrixXd(3, 1), square); },
          "rows of the normal equations has 2 values, expected 3");
  refused([&] { add_transposed_product(square, square, 3, sum); },
          "rows = [0, 3), allowed within [0, 2)");
}

}  // namespace risley::algebra::entries_test
