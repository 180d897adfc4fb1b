// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "risley/calibration/wall_shape.hpp"

namespace risley::calibration {

/// The part of one wall in normal equations after elimination of the unknowns that are its own:
/// many recordings have many walls, and all their unknowns in one matrix would fill the memory.
struct WithoutOwn {
  Eigen::MatrixXd normal;     ///< of its own unknowns [own, own]
  Eigen::MatrixXd inverse;    ///< of the same
  Eigen::MatrixXd from_rest;  ///< inverse times their coupling with the others [own, others]
  Eigen::MatrixXd rest;       ///< reduced equations of the others [others, others]
  double log_determinant = 0;
  bool positive = true;
};

/// @param system   symmetric, its own unknowns first
/// @param damping  of its own unknowns, as a part of the diagonal
WithoutOwn without_own(const Eigen::MatrixXd& system, Eigen::Index own, double damping = 0);

/// Adds the entries for some rows and columns of a larger matrix to it.
void add_at(const std::vector<Eigen::Index>& places, const Eigen::MatrixXd& part,
            Eigen::MatrixXd& whole);

/// A linear problem reduced to the unknowns that walls share.
struct SharedSolution {
  Eigen::VectorXd step;        ///< [unknowns]
  Eigen::MatrixXd normal;      ///< everything else eliminated [unknowns, unknowns]
  Eigen::MatrixXd covariance;  ///< [unknowns, unknowns]
  Eigen::MatrixXd response;    ///< -N^-1 N_q [unknowns, quantities]
  double log_determinant = 0;  ///< of the normal equations
  double cost = 0;             ///< less what the step saves
  bool positive = false;
};

/// @param system  of unknowns, quantities and the residual, every wall's own unknowns eliminated
SharedSolution shared_solution(const Eigen::MatrixXd& system, Eigen::Index unknowns);

/// The unknowns of one wall, given the shared ones.
/// @param places  in the whole system, of the columns after its own unknowns
OwnSolution own_solution(const WithoutOwn& wall, const std::vector<Eigen::Index>& places,
                         const SharedSolution& shared);

/// Covariance of a wall's own unknowns and of the shared ones coupled with them, in the order of
/// its places, which has them first.
Eigen::MatrixXd joint_covariance(const WithoutOwn& wall, const std::vector<Eigen::Index>& places,
                                 const Eigen::MatrixXd& shared_covariance);

}  // namespace risley::calibration
