// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The shape of walls against dense matrices, and against walls drawn from the process itself.
#include "risley/calibration/wall_shape.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"

namespace risley::wall_shape_test {

using calibration::ShapeParameters;
using calibration::ShapePrior;
using calibration::ShapeProblem;
using calibration::ShapeSolution;
using calibration::WallGrid;
using Eigen::Index;
using Eigen::MatrixXd;

WallGrid grid_of(int cells_u, int cells_v, double spacing) {
  WallGrid grid{spacing, -1.0, 0.5, cells_u, cells_v, {}};
  for (int i = 0; i < cells_u * cells_v; ++i) {
    if (i % 5 != 3) grid.cells.push_back(static_cast<std::uint32_t>(i));  // some see no shot
  }
  return grid;
}

/// Precision of the process at the nodes, node (u, v) at v (cells_u + 1) + u, from its definition.
MatrixXd precision_of(const WallGrid& grid, const ShapeParameters& p) {
  const int nu = grid.cells_u + 1, nv = grid.cells_v + 1;
  const double kappa = 2.0 / p.length;
  MatrixXd once = MatrixXd::Zero(nu * nv, nu * nv);
  const auto link = [&](int a, int b) {
    once(a, a) += 1;
    once(b, b) += 1;
    once(a, b) -= 1;
    once(b, a) -= 1;
  };
  for (int v = 0; v < nv; ++v) {
    for (int u = 0; u < nu; ++u) {
      if (u + 1 < nu) link(v * nu + u, v * nu + u + 1);
      if (v + 1 < nv) link(v * nu + u, v * nu + u + nu);
    }
  }
  once += std::pow(kappa * grid.spacing, 2) * MatrixXd::Identity(nu * nv, nu * nv);
  const double tau2 = 1.0 / (8.0 * kPi * std::pow(kappa, 4) * p.sigma * p.sigma);
  return tau2 * std::pow(grid.spacing, -4) * once * once * once;
}

struct Wall {
  calibration::WallSums sums;
  MatrixXd rows;   ///< [shots, unknowns + quantities + 1], weighted: columns and the residual
  MatrixXd nodes;  ///< [shots, nodes], weighted
  MatrixXd white;  ///< [shots, cells], weighted
};

/// Shots at random, and their sums.
Wall wall_of(const WallGrid& grid, Index columns, std::uint64_t seed) {
  constexpr Index kShots = 400;
  const RandomStream random(seed, 1);
  Wall wall;
  wall.sums.grid = grid;
  const Index cells = grid.cells.size();
  wall.sums.weight.assign(grid.cells.size(), Eigen::Matrix3d::Zero());
  wall.sums.columns.setZero(3 * cells, columns);
  wall.rows.resize(kShots, columns);
  wall.nodes.setZero(kShots, grid.nodes());
  wall.white.setZero(kShots, cells);
  std::uint64_t number = 0;
  for (Index i = 0; i < kShots; ++i) {
    const auto cell =
        static_cast<std::size_t>(random.uniform(number++) * static_cast<double>(cells));
    const double du = grid.spacing * (random.uniform(number++) - 0.5);
    const double dv = grid.spacing * (random.uniform(number++) - 0.5);
    const double d = 50.0 * (1.0 + random.uniform(number++));
    for (Index j = 0; j < columns; ++j) wall.rows(i, j) = random.normal(number++);
    const Eigen::Vector3d e = d * Eigen::Vector3d(1, du, dv);
    wall.sums.weight[cell] += e * e.transpose();
    wall.sums.columns.middleRows<3>(3 * cell) += e * wall.rows.row(i);
    wall.white(i, cell) = d;
    const Index u = grid.cells[cell] % grid.row(), v = grid.cells[cell] / grid.row();
    const Index nu = grid.cells_u + 1;
    const double slope = 0.5 / grid.spacing;
    wall.nodes(i, v * nu + u) = d * (0.25 - slope * du - slope * dv);
    wall.nodes(i, v * nu + u + 1) = d * (0.25 + slope * du - slope * dv);
    wall.nodes(i, v * nu + u + nu) = d * (0.25 - slope * du + slope * dv);
    wall.nodes(i, v * nu + u + nu + 1) = d * (0.25 + slope * du + slope * dv);
  }
  return wall;
}

constexpr Index kUnknowns = 3, kQuantities = 2, kColumns = kUnknowns + kQuantities + 1;

struct Dense {
  Eigen::VectorXd step;
  MatrixXd covariance, response;
  double log_likelihood = 0;
};

/// The same with all nodes and cells as unknowns of their own.
Dense dense(const std::vector<Wall>& walls, const ShapeParameters& p, const MatrixXd& prior) {
  // Covariance of all residuals, then generalised least squares.
  Dense result;
  MatrixXd normal = prior, cross = MatrixXd::Zero(kUnknowns, kQuantities);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(kUnknowns);
  double squares = 0, determinant = 0;
  for (const Wall& wall : walls) {
    const MatrixXd process = precision_of(wall.sums.grid, p).inverse();
    MatrixXd covariance = MatrixXd::Identity(wall.rows.rows(), wall.rows.rows());
    covariance += wall.nodes * process * wall.nodes.transpose();
    covariance += p.white * p.white * wall.white * wall.white.transpose();
    const Eigen::LLT<MatrixXd> factor(covariance);
    const MatrixXd solved = factor.solve(wall.rows);
    const MatrixXd products = wall.rows.transpose() * solved;
    normal += products.topLeftCorner(kUnknowns, kUnknowns);
    cross += products.block(0, kUnknowns, kUnknowns, kQuantities);
    right += products.col(kColumns - 1).head(kUnknowns);
    squares += products(kColumns - 1, kColumns - 1);
    determinant += 2.0 * factor.matrixLLT().diagonal().array().log().sum();
  }
  result.covariance = normal.inverse();
  result.step = result.covariance * right;
  result.response = -result.covariance * cross;
  result.log_likelihood =
      -0.5 * (determinant + std::log(normal.determinant()) + squares - right.dot(result.step));
  return result;
}

ShapeProblem problem_of(const std::vector<Wall>& walls, const MatrixXd& prior) {
  ShapeProblem problem;
  problem.unknowns = kUnknowns;
  problem.system = MatrixXd::Zero(kColumns, kColumns);
  problem.system.topLeftCorner(kUnknowns, kUnknowns) = prior;
  for (const Wall& wall : walls) {
    calibration::WallSums& sums = problem.walls.emplace_back(wall.sums);
    sums.system = wall.rows.transpose() * wall.rows;
    for (Index j = 0; j < kColumns; ++j) sums.places.push_back(j);
  }
  return problem;
}

TEST(WallShape, IsWhatDenseMatricesSay) {
  const std::vector<Wall> walls{wall_of(grid_of(9, 4, 0.3), kColumns, 5),
                                wall_of(grid_of(3, 7, 0.25), kColumns, 6)};
  const MatrixXd prior = 2.0 * MatrixXd::Identity(kUnknowns, kUnknowns);
  const ShapeProblem problem = problem_of(walls, prior);
  const std::vector<ShapeParameters> tried{
      {0.02, 0.8, 0.0}, {0.01, 0.8, 0.0}, {0.01, 0.8, 0.004}, {0.01, 1.6, 0.004}};
  std::vector<double> likelihood;
  for (const ShapeParameters& p : tried) {
    const ShapeSolution found = solve_with_shape(problem, ShapePrior{{p}, {1.0}});
    ASSERT_TRUE(found.positive);
    const Dense expected = dense(walls, p, prior);
    EXPECT_LT((found.step - expected.step).norm(), 1e-9 * expected.step.norm());
    EXPECT_LT((found.covariance - expected.covariance).norm(), 1e-9 * expected.covariance.norm());
    EXPECT_LT((found.response - expected.response).norm(), 1e-9 * expected.response.norm());
    likelihood.push_back(expected.log_likelihood);
  }
  // Together they weigh as their marginal likelihoods do.
  const ShapeSolution all = solve_with_shape(problem, ShapePrior{tried, {0.25, 0.25, 0.25, 0.25}});
  double seen = 0;
  for (std::size_t i = 0; i < tried.size(); ++i) {
    if (all.weight[i] == 0) continue;  // far from all likely ones
    EXPECT_NEAR(std::log(all.weight[i] / all.weight[all.likeliest]),
                likelihood[i] - likelihood[all.likeliest], 1e-6);
    seen += all.weight[i];
  }
  EXPECT_NEAR(seen, 1.0, 1e-12);
  const auto most = std::ranges::max_element(likelihood) - likelihood.begin();
  EXPECT_EQ(all.likeliest, static_cast<std::size_t>(most));
}

/// The first unknown moved from the whole system to the walls' own, where one wall has to do with
/// it.
ShapeProblem with_own_unknown(const Wall& wall, const MatrixXd& prior) {
  ShapeProblem problem;
  problem.unknowns = kUnknowns - 1;
  problem.system = MatrixXd::Zero(kColumns - 1, kColumns - 1);
  problem.system.topLeftCorner(kUnknowns - 1, kUnknowns - 1) =
      prior.bottomRightCorner(kUnknowns - 1, kUnknowns - 1);
  calibration::WallSums& sums = problem.walls.emplace_back(wall.sums);
  sums.own = 1;
  sums.system = wall.rows.transpose() * wall.rows;
  sums.system(0, 0) += prior(0, 0);
  for (Index j = 0; j < kColumns - 1; ++j) sums.places.push_back(j);
  return problem;
}

TEST(WallShape, UnknownsOfOneWallMayBeItsOwn) {
  const Wall wall = wall_of(grid_of(9, 4, 0.3), kColumns, 5);
  const MatrixXd prior = 2.0 * MatrixXd::Identity(kUnknowns, kUnknowns);
  const ShapePrior shapes{{{0.02, 0.8, 0.0}, {0.01, 0.8, 0.004}}, {0.5, 0.5}};
  const ShapeSolution together = solve_with_shape(problem_of({wall}, prior), shapes);
  const ShapeSolution apart = solve_with_shape(with_own_unknown(wall, prior), shapes);
  ASSERT_TRUE(apart.positive);
  const auto near = [](const MatrixXd& a, const MatrixXd& b) {
    return a.rows() == b.rows() && a.cols() == b.cols() && (a - b).norm() <= 1e-9 * b.norm();
  };
  EXPECT_TRUE(near(apart.step, together.step.tail(2)));
  EXPECT_TRUE(near(apart.own.at(0).step, together.step.head(1)));
  EXPECT_TRUE(near(apart.covariance, together.covariance.bottomRightCorner(2, 2)));
  EXPECT_TRUE(near(apart.own.at(0).covariance, together.covariance.topLeftCorner(1, 1)));
  EXPECT_TRUE(near(apart.response, together.response.bottomRows(2)));
  EXPECT_TRUE(near(apart.own.at(0).response, together.response.topRows(1)));
  EXPECT_TRUE(near(apart.height.at(0), together.height.at(0)));
  EXPECT_NEAR(apart.promised, together.promised, 1e-9 * together.promised);
  EXPECT_NEAR(apart.weight.at(0), together.weight.at(0), 1e-9);
}

TEST(WallShape, ProcessHasTheVarianceThatItStates) {
  const WallGrid grid = grid_of(40, 40, 0.2);
  const ShapeParameters p{0.003, 0.8, 0.0};
  const MatrixXd covariance = precision_of(grid, p).inverse();
  const Index middle = 20 * 41 + 20;
  EXPECT_NEAR(std::sqrt(covariance(middle, middle)) / p.sigma, 1.0, 0.03);
  // Matern of nu = 2: half of it is left at 0.93 lengths.
  EXPECT_NEAR(covariance(middle, middle + 4) / covariance(middle, middle), 0.45, 0.05);
}

TEST(WallShape, RefusesSumsOfOtherSizes) {
  ShapeProblem problem = problem_of({wall_of(grid_of(3, 3, 0.3), kColumns, 7)},
                                    MatrixXd::Identity(kUnknowns, kUnknowns));
  problem.walls.front().weight.pop_back();
  EXPECT_THROW(solve_with_shape(problem, calibration::building_walls()), InvalidArgument);
  problem = problem_of({}, MatrixXd::Identity(kUnknowns, kUnknowns));
  problem.unknowns = kColumns;
  EXPECT_THROW(solve_with_shape(problem, calibration::building_walls()), InvalidArgument);
}

}  // namespace risley::wall_shape_test
