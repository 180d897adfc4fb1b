// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace risley::calibration {

/// A square grid over a wall, in the coordinates of tangents_of() its normal in the scene's frame.
/// Nodes are the corners of the cells, at which the deviation from the plane is known.
struct WallGrid {
  double spacing = 0;                ///< of the nodes, m
  double first_u = 0, first_v = 0;   ///< of node (0, 0), m
  int cells_u = 0, cells_v = 0;      ///< along both tangents
  std::vector<std::uint32_t> cells;  ///< those with shots, ascending: v * cells_u + u

  bool empty() const { return cells.empty(); }
  /// Corners of all its cells.
  Eigen::Index nodes() const {
    return empty() ? 0 : static_cast<Eigen::Index>(cells_u + 1) * (cells_v + 1);
  }
  /// Middle of one of the cells with shots, m.
  double middle_u(std::size_t cell) const {
    return first_u + spacing * (0.5 + static_cast<double>(cells[cell] % row()));
  }
  /// As middle_u(), m.
  double middle_v(std::size_t cell) const {
    const std::uint32_t from_first = cells[cell] / row();
    return first_v + spacing * (0.5 + static_cast<double>(from_first));
  }
  std::uint32_t row() const { return static_cast<std::uint32_t>(cells_u); }  ///< cells of one row
};

/// Deviation of walls from their planes: a zero-mean Gaussian process over each wall, whose
/// correlation is that of Matern with nu = 2, and an independent part for every cell.
struct ShapeParameters {
  double sigma = 0;   ///< of the process, m
  double length = 0;  ///< of its correlation, m: the process is kappa = 2 / length wide
  double white = 0;   ///< sigma of the cells' own part, m
};

/// Prior for the shape of walls: candidate parameters with their weights.
struct ShapePrior {
  std::vector<ShapeParameters> parameters;
  std::vector<double> weight;  ///< [parameters], sum 1
};

/// Finished walls of buildings. docs/theory/calibration.md, section Walls have shape
ShapePrior building_walls();
/// One central set of parameters, for plans, which have no data to weigh them by.
ShapePrior typical_walls();

/// Sums over the shots of all views of one wall. Their columns are those of unknowns that are the
/// wall's own, and then of those of the whole system that it has to do with: `places`, ascending,
/// the residual last.
struct WallSums {
  Eigen::Index own = 0;              ///< unknowns of the wall alone
  std::vector<Eigen::Index> places;  ///< columns of ShapeProblem::system
  Eigen::MatrixXd system;            ///< J' W J [own + places, own + places]
  WallGrid grid;                     ///< empty: the wall is flat
  /// By cells: with e = (1, u - middle, v - middle) and the derivative d of a shot's range by the
  /// wall's height, the sum of w d^2 e e' [cells][3, 3].
  std::vector<Eigen::Matrix3d> weight;
  /// Sum of w d e x', for the columns x [3 cells, own + places].
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> columns;
};

/// A linear least squares problem of unknowns, further quantities that are not estimated, and walls
/// with unknowns of their own and a shape.
struct ShapeProblem {
  /// J' W J of unknowns, quantities and the residual, with the priors of the unknowns
  /// [unknowns + quantities + 1, ...], less what is in the walls. The block of the quantities alone
  /// is not used.
  Eigen::MatrixXd system;
  Eigen::Index unknowns = 0;
  std::vector<WallSums> walls;
};

/// Estimate of one wall's own unknowns.
struct OwnSolution {
  Eigen::VectorXd step;        ///< [own]
  Eigen::MatrixXd covariance;  ///< [own, own]
  Eigen::MatrixXd response;    ///< to the quantities [own, quantities]
};

/// The system with the walls' shape integrated out, for the candidate parameters.
struct ShapeSolution {
  Eigen::VectorXd step;        ///< [unknowns], mean over the parameters
  Eigen::MatrixXd covariance;  ///< [unknowns, unknowns], the spread of the means included
  Eigen::MatrixXd response;    ///< -N^-1 N_q [unknowns, quantities], mean
  /// N of the likeliest parameters without the walls' own unknowns [unknowns, unknowns].
  Eigen::MatrixXd normal;
  std::vector<OwnSolution> own;  ///< [walls], as the above
  double promised = 0;           ///< squared length of the step of all unknowns, in sigmas
  std::vector<double> weight;    ///< of the parameters after the data, sum 1
  ShapeParameters mean;          ///< of the parameters, so weighted
  std::size_t likeliest = 0;     ///< row of the parameters
  /// Deviation at the nodes, of the likeliest parameters, node (u, v) at v (cells_u + 1) + u
  /// [walls][nodes], m.
  std::vector<Eigen::VectorXd> height;
  bool positive = false;  ///< whether the normal equations could be solved
};

/// Integrates the walls' shape out, candidate by candidate, and weights the candidates by their
/// marginal likelihood. Candidates far from all likely ones are skipped and have weight 0.
///                                   Derivation: docs/theory/calibration.md
/// @throws InvalidArgument for a system or sums of other sizes
ShapeSolution solve_with_shape(const ShapeProblem& problem, const ShapePrior& prior);

/// Without the parameters whose weight in a solution is less than a thousandth.
ShapePrior likely_part(const ShapePrior& prior, const ShapeSolution& solution);

}  // namespace risley::calibration
