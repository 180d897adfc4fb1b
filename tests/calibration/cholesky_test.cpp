// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/cholesky.hpp"

#include <cstdlib>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace risley::calibration::cholesky_test {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd positive_matrix(Index size) {
  std::srand(5);
  const MatrixXd root = MatrixXd::Random(size, size);
  return root * root.transpose() + MatrixXd::Identity(size, size);
}

TEST(Cholesky, SolvesAtEverySizeAboutATile) {
  for (const Index size : {1, 2, 127, 128, 129, 300, 515}) {
    const MatrixXd matrix = positive_matrix(size);
    MatrixXd lower = matrix.triangularView<Eigen::Lower>();  // what is above does not count
    const Cholesky own(lower);
    ASSERT_TRUE(own.positive());
    const MatrixXd factor = own.factor().triangularView<Eigen::Lower>();
    const MatrixXd expected = Eigen::LLT<MatrixXd>(matrix).matrixL();
    EXPECT_LT((factor - expected).cwiseAbs().maxCoeff(), 1e-12 * static_cast<double>(size)) << size;
    const MatrixXd right = MatrixXd::Random(size, 3);
    MatrixXd solved = right;
    own.solve_in_place(solved);
    EXPECT_LT((matrix * solved - right).cwiseAbs().maxCoeff(), 1e-9) << size;
  }
}

TEST(Cholesky, IsTheSameForAnyNumberOfThreads) {
  const MatrixXd matrix = positive_matrix(400);
  const Cholesky all(matrix);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(Cholesky(matrix).factor(), all.factor());
}

TEST(Cholesky, SaysWhereThereIsNone) {
  for (const Index where : {0, 130, 299}) {
    MatrixXd matrix = positive_matrix(300);
    matrix(where, where) = -1;
    EXPECT_FALSE(Cholesky(matrix).positive()) << where;
  }
}

}  // namespace risley::calibration::cholesky_test
