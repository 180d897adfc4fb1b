// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/own_unknowns.hpp"

#include "risley/algebra/products.hpp"
#include "risley/algebra/symmetric.hpp"

namespace risley::calibration {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

/// Number of a wall's places that are unknowns of the whole system: they come first.
Index unknowns_among(const std::vector<Index>& places, Index unknowns) {
  Index count = 0;
  while (count < std::ssize(places) && places[count] < unknowns) {
    ++count;
  }
  return count;
}

}  // namespace

WithoutOwn without_own(const MatrixXd& system, Index own, double damping) {
  WithoutOwn result;
  const Index others = system.cols() - own;
  result.rest = system.bottomRightCorner(others, others);
  result.from_rest = MatrixXd::Zero(own, others);
  if (own == 0) return result;
  result.normal = system.topLeftCorner(own, own);
  const algebra::SymmetricSolver solver(result.normal, damping);
  result.positive = solver.positive();
  if (!result.positive) return result;
  const MatrixXd shared = system.topRightCorner(own, others);
  result.inverse = solver.inverse();
  result.from_rest = solver.solve_columns(shared);
  result.rest -= algebra::transposed_product(shared, result.from_rest);
  result.log_determinant = solver.log_determinant();
  return result;
}

void add_at(const std::vector<Index>& places, const MatrixXd& part, MatrixXd& whole) {
  for (Index j = 0; j < part.cols(); ++j) {
    const Index column = places[j];
    for (Index i = 0; i < part.rows(); ++i) {
      whole(places[i], column) += part(i, j);
    }
  }
}

SharedSolution shared_solution(const MatrixXd& system, Index unknowns) {
  const Index quantities = system.cols() - unknowns - 1;
  SharedSolution shared;
  shared.normal = system.topLeftCorner(unknowns, unknowns);
  const Eigen::VectorXd gradient = system.col(system.cols() - 1).head(unknowns);
  const algebra::SymmetricSolver solver(shared.normal);
  shared.positive = solver.positive();
  if (!shared.positive) return shared;
  shared.step = solver.solve(gradient);
  shared.covariance = solver.inverse();
  shared.response = -solver.solve_columns(system.block(0, unknowns, unknowns, quantities).eval());
  shared.log_determinant = solver.log_determinant();
  shared.cost = system(system.rows() - 1, system.cols() - 1) - gradient.dot(shared.step);
  return shared;
}

OwnSolution own_solution(const WithoutOwn& wall, const std::vector<Index>& places,
                         const SharedSolution& shared) {
  const Index unknowns = shared.step.size(), own = wall.from_rest.rows();
  const Index known = unknowns_among(places, unknowns);
  OwnSolution solution;
  solution.step = wall.from_rest.rightCols(1);
  solution.response = MatrixXd::Zero(own, shared.response.cols());
  for (Index j = 0; j < std::ssize(places) - 1; ++j) {
    const Index place = places[j];
    if (j < known) {
      solution.step -= wall.from_rest.col(j) * shared.step[place];
      solution.response -= wall.from_rest.col(j) * shared.response.row(place);
    } else {
      solution.response.col(place - unknowns) -= wall.from_rest.col(j);
    }
  }
  solution.covariance = joint_covariance(wall, places, shared.covariance).topLeftCorner(own, own);
  return solution;
}

MatrixXd joint_covariance(const WithoutOwn& wall, const std::vector<Index>& places,
                          const MatrixXd& shared_covariance) {
  const Index own = wall.from_rest.rows();
  const Index known = unknowns_among(places, shared_covariance.cols());
  const std::vector<Index> rows(places.begin(), places.begin() + known);
  const MatrixXd shared = shared_covariance(rows, rows);
  const MatrixXd lever = wall.from_rest.leftCols(known);
  MatrixXd joint(own + known, own + known);
  joint.bottomRightCorner(known, known) = shared;
  joint.topRightCorner(own, known) = -algebra::product(lever, shared);
  joint.bottomLeftCorner(known, own) = joint.topRightCorner(own, known).transpose();
  joint.topLeftCorner(own, own) = algebra::propagated(lever, shared);
  if (own > 0) joint.topLeftCorner(own, own) += wall.inverse;
  return joint;
}

}  // namespace risley::calibration
