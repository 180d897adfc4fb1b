// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/algebra/products.hpp"

#include <gtest/gtest.h>

namespace risley::algebra::products_test {

using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(Products, AreThoseOfTheirNames) {
  MatrixXd a(2, 3), b(3, 2), c(2, 2);
  a << 1, 2, 3, 4, 5, 6;
  b << 1, 0, 0, 1, 1, 1;
  c << 2, 1, 1, 3;
  EXPECT_EQ(product(a, b), (MatrixXd(2, 2) << 4, 5, 10, 11).finished());
  EXPECT_EQ(times(a, VectorXd::Ones(3)), (VectorXd(2) << 6, 15).finished());
  EXPECT_EQ(transposed_times(a, VectorXd::Ones(2)), (VectorXd(3) << 5, 7, 9).finished());
  EXPECT_EQ(transposed_product(a, c), (MatrixXd(3, 2) << 6, 13, 9, 17, 12, 21).finished());
  EXPECT_EQ(propagated(MatrixXd::Ones(1, 2), c), MatrixXd::Constant(1, 1, 7));
  EXPECT_EQ(pulled_back(MatrixXd::Ones(2, 1), c), MatrixXd::Constant(1, 1, 7));
  MatrixXd sum = MatrixXd::Ones(3, 2);
  add_transposed_product(a, c, 1, sum);
  EXPECT_EQ(sum, (MatrixXd(3, 2) << 3, 2, 5, 3, 7, 4).finished());
}

}  // namespace risley::algebra::products_test
