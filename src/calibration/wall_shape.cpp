// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/wall_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/SparseCore>

#include "risley/algebra/products.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/require.hpp"
#include "risley/parallel/parallel.hpp"

#include "calibration/band_cholesky.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Smoothness nu of the process, and the power nu + 1 of kappa^2 - Laplace that is its precision.
constexpr int kSmoothness = 2, kPower = kSmoothness + 1;

/// Numbers of the nodes: those along the shorter side follow each other, which keeps the band
/// narrow.
struct NodeOrder {
  Index along_u, along_v;  ///< steps of the number

  explicit NodeOrder(const WallGrid& grid)
      : along_u(grid.cells_u < grid.cells_v ? 1 : grid.cells_v + 1),
        along_v(grid.cells_u < grid.cells_v ? grid.cells_u + 1 : 1) {}

  Index node(Index u, Index v) const { return u * along_u + v * along_v; }
  Index band() const { return kPower * std::max(along_u, along_v); }
};

/// Precision of the process on a grid but for a factor: the power of kappa^2 - Laplace, times the
/// spacing squared, with the slope 0 at the border (Lindgren, Rue and Lindstrom 2011).
class Precision {
 public:
  explicit Precision(const WallGrid& grid) : grid_(grid), order_(grid) {
    Eigen::SparseMatrix<double> power(grid.nodes(), grid.nodes());
    power.setIdentity();
    const Eigen::SparseMatrix<double> once = laplacian();
    for (int i = 0; i <= kPower; ++i) {
      powers_.push_back(power);
      power = power * once;
    }
  }

  /// Adds it to a matrix. @return log of its determinant
  double add_to(BandMatrix& matrix, const ShapeParameters& p) const {
    const double h = grid_.spacing, kappa = std::sqrt(2.0 * kSmoothness) / p.length;
    const double diagonal = kappa * kappa * h * h;
    // Variance of the process: 1 / (4 pi nu kappa^(2 nu) tau^2).
    const double tau2 =
        1.0 / (4.0 * kPi * kSmoothness * std::pow(kappa, 2 * kSmoothness) * p.sigma * p.sigma);
    const double factor = tau2 * std::pow(h, 2 - 2 * kPower);
    double binomial = 1;
    for (int i = 0; i <= kPower; ++i) {
      const double part = factor * binomial * std::pow(diagonal, kPower - i);
      binomial = binomial * (kPower - i) / (i + 1);
      const Eigen::SparseMatrix<double>& power = powers_[static_cast<std::size_t>(i)];
      for (Index column = 0; column < power.outerSize(); ++column) {
        for (Eigen::SparseMatrix<double>::InnerIterator entry(power, column); entry; ++entry) {
          if (entry.row() >= column) matrix.at(entry.row(), column) += part * entry.value();
        }
      }
    }
    double log_determinant = static_cast<double>(grid_.nodes()) * std::log(factor);
    const int nu = grid_.cells_u + 1, nv = grid_.cells_v + 1;
    for (int i = 0; i < nu; ++i) {
      for (int j = 0; j < nv; ++j) {
        const double value =
            diagonal + 4.0 - 2.0 * std::cos(kPi * i / nu) - 2.0 * std::cos(kPi * j / nv);
        log_determinant += kPower * std::log(value);
      }
    }
    return log_determinant;
  }

 private:
  /// Minus Laplace, times the spacing squared.
  Eigen::SparseMatrix<double> laplacian() const {
    std::vector<Eigen::Triplet<double>> entries;
    const Index nu = grid_.cells_u + 1, nv = grid_.cells_v + 1;
    for (Index u = 0; u < nu; ++u) {
      for (Index v = 0; v < nv; ++v) {
        const Index own = order_.node(u, v);
        const auto link = [&](Index other) {
          entries.emplace_back(own, own, 1.0);
          entries.emplace_back(other, other, 1.0);
          entries.emplace_back(own, other, -1.0);
          entries.emplace_back(other, own, -1.0);
        };
        if (u + 1 < nu) link(order_.node(u + 1, v));
        if (v + 1 < nv) link(order_.node(u, v + 1));
      }
    }
    Eigen::SparseMatrix<double> matrix(grid_.nodes(), grid_.nodes());
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
  }

  const WallGrid& grid_;
  NodeOrder order_;
  std::vector<Eigen::SparseMatrix<double>> powers_;  ///< of it [kPower + 1]
};

/// One wall's part of the normal equations when its cells' own parts are integrated out.
struct WallEquations {
  BandMatrix nodes;          ///< J' W J of the nodes
  BandMatrix::Rows columns;  ///< with unknowns, quantities and the residual [nodes, columns]
};

/// Integrates a part of its own out of every cell.
/// @param[in,out] system  less what the cells take
/// @return the wall's equations, and the log of the determinant of the cells' parts
std::pair<WallEquations, double> without_white_part(const WallSums& sums, double white,
                                                    MatrixXd& system) {
  const WallGrid& grid = sums.grid;
  const NodeOrder order(grid);
  WallEquations equations{BandMatrix(grid.nodes(), order.band()),
                          BandMatrix::Rows::Zero(grid.nodes(), sums.columns.cols())};
  const auto cells = static_cast<Index>(grid.cells.size());
  MatrixXd taken(cells, sums.columns.cols());
  double log_determinant = 0;
  for (Index cell = 0; cell < cells; ++cell) {
    Eigen::Matrix3d weight = sums.weight[static_cast<std::size_t>(cell)];
    auto rows = sums.columns.middleRows<3>(3 * cell).eval();
    const double all = weight(0, 0), variance = white * white;
    const double factor = variance / (1.0 + variance * all);
    log_determinant += std::log1p(variance * all);
    taken.row(cell) = std::sqrt(factor) * rows.row(0);
    const Eigen::Vector3d first = weight.col(0);
    rows -= (factor * first) * rows.row(0).eval();
    weight -= factor * first * first.transpose();
    // Heights of the four corners to height and slopes in the middle.
    const std::uint32_t number = grid.cells[static_cast<std::size_t>(cell)];
    const Index u = number % grid.row(), v = number / grid.row();
    const double slope = 0.5 / grid.spacing;
    const std::array<Index, 4> corner{order.node(u, v), order.node(u + 1, v), order.node(u, v + 1),
                                      order.node(u + 1, v + 1)};
    Eigen::Matrix<double, 3, 4> shape;
    shape << 0.25, 0.25, 0.25, 0.25, -slope, slope, -slope, slope, -slope, -slope, slope, slope;
    const Eigen::Matrix4d product = shape.transpose() * weight * shape;
    for (int a = 0; a < 4; ++a) {
      equations.columns.row(corner[a]) += shape.col(a).transpose() * rows;
      for (int b = 0; b < 4; ++b) {
        if (corner[a] >= corner[b]) equations.nodes.at(corner[a], corner[b]) += product(a, b);
      }
    }
  }
  system -= taken.transpose() * taken;
  return {std::move(equations), log_determinant};
}

/// What one wall takes out of the system for some parameters of its process.
struct WallShare {
  MatrixXd system;
  double log_determinant = 0;  ///< of the nodes' matrix over that of the process
  bool positive = false;
};

WallShare share_of(const Precision& precision, WallEquations equations, const ShapeParameters& p) {
  WallShare share;
  const double of_process = precision.add_to(equations.nodes, p);
  share.positive = equations.nodes.factorise();
  if (!share.positive) return share;
  equations.nodes.solve_lower(equations.columns);
  share.log_determinant = equations.nodes.log_determinant() - of_process;
  share.system = equations.columns.transpose() * equations.columns;
  return share;
}

/// The linear problem of the unknowns when everything else is integrated out.
struct Remaining {
  Eigen::VectorXd step;
  MatrixXd covariance, normal, response;
  double log_likelihood = 0;
  bool positive = false;
};

Remaining remaining(const MatrixXd& system, Index unknowns, double log_determinant) {
  const Index quantities = system.cols() - unknowns - 1;
  Remaining r;
  r.normal = system.topLeftCorner(unknowns, unknowns);
  const Eigen::VectorXd gradient = system.col(system.cols() - 1).head(unknowns);
  const Eigen::VectorXd scale = algebra::unit_scale(r.normal.diagonal());
  const algebra::SymmetricSolver solver(r.normal);
  r.positive = solver.positive();
  if (!r.positive) return r;
  r.step = solver.solve(gradient);
  r.covariance = solver.inverse();
  r.response = -solver.solve_columns(system.block(0, unknowns, unknowns, quantities).eval());
  const Eigen::LDLT<MatrixXd> factors(algebra::scaled(r.normal, scale));
  const double of_normal = factors.vectorD().array().log().sum() - 2.0 * scale.array().log().sum();
  const double cost = system(system.rows() - 1, system.cols() - 1) - gradient.dot(r.step);
  r.log_likelihood = -0.5 * (log_determinant + of_normal + cost);
  return r;
}

}  // namespace

ShapePrior building_walls() {
  constexpr double kSigmas[] = {0.6e-3, 1.2e-3, 2.4e-3, 4.8e-3, 9.6e-3};
  constexpr double kLengths[] = {0.45, 0.9, 1.8, 3.6};
  constexpr double kWhites[] = {0.5e-3, 1.5e-3};
  ShapePrior prior;
  double sum = 0;
  for (const double white : kWhites) {
    for (const double sigma : kSigmas) {
      for (const double length : kLengths) {
        const double of_sigma = std::log(sigma / 1.5e-3) / std::log(2.5);
        const double of_length = std::log(length / 2.0) / std::log(2.0);
        prior.parameters.push_back({sigma, length, white});
        prior.weight.push_back(std::exp(-0.5 * (of_sigma * of_sigma + of_length * of_length)));
        sum += prior.weight.back();
      }
    }
  }
  for (double& weight : prior.weight) weight /= sum;
  return prior;
}

ShapeSolution solve_with_shape(const ShapeProblem& problem, const ShapePrior& prior) {
  const Index columns = problem.system.cols();
  require_length("rows of the system", static_cast<std::size_t>(problem.system.rows()),
                 static_cast<std::size_t>(columns));
  require_between("unknowns", static_cast<double>(problem.unknowns), 1,
                  static_cast<double>(columns - 1));
  require_length("weights of the shape", prior.weight.size(), prior.parameters.size());
  for (const WallSums& wall : problem.walls) {
    require_length("cells", wall.weight.size(), wall.grid.cells.size());
    require_length("rows of cells", static_cast<std::size_t>(wall.columns.rows()),
                   3 * wall.grid.cells.size());
    require_length("columns of cells", static_cast<std::size_t>(wall.columns.cols()),
                   static_cast<std::size_t>(columns));
  }

  const std::size_t walls = problem.walls.size(), tried = prior.parameters.size();
  // The cells' own part first: the same equations serve every process.
  std::vector<double> whites;
  for (const ShapeParameters& p : prior.parameters) whites.push_back(p.white);
  std::sort(whites.begin(), whites.end());
  whites.erase(std::unique(whites.begin(), whites.end()), whites.end());
  const auto white_row = [&](double white) {
    return static_cast<std::size_t>(std::find(whites.begin(), whites.end(), white) -
                                    whites.begin());
  };
  struct OfWhite {
    std::vector<WallEquations> equations;
    std::vector<MatrixXd> taken;
    std::vector<double> log_determinant;
  };
  std::vector<OfWhite> of_white(whites.size());
  for (OfWhite& own : of_white) {
    own.equations.assign(walls, {BandMatrix(0, 0), {}});
    own.taken.assign(walls, MatrixXd::Zero(columns, columns));
    own.log_determinant.assign(walls, 0.0);
  }
  parallel::for_each(whites.size() * walls, [&](std::size_t i) {
    OfWhite& own = of_white[i / walls];
    const std::size_t wall = i % walls;
    std::tie(own.equations[wall], own.log_determinant[wall]) =
        without_white_part(problem.walls[wall], whites[i / walls], own.taken[wall]);
  });
  std::vector<Precision> precision;
  for (const WallSums& wall : problem.walls) precision.emplace_back(wall.grid);
  std::vector<WallShare> shares(tried * walls);
  parallel::for_each(shares.size(), [&](std::size_t i) {
    const ShapeParameters& p = prior.parameters[i / walls];
    const std::size_t wall = i % walls;
    shares[i] = share_of(precision[wall], of_white[white_row(p.white)].equations[wall], p);
  });

  std::vector<Remaining> all;
  ShapeSolution solution;
  double best = 0;
  for (std::size_t k = 0; k < tried; ++k) {
    const OfWhite& own = of_white[white_row(prior.parameters[k].white)];
    MatrixXd system = problem.system;
    double log_determinant = 0;
    bool positive = true;
    for (std::size_t wall = 0; wall < walls; ++wall) {
      const WallShare& share = shares[k * walls + wall];
      positive = positive && share.positive;
      if (!share.positive) break;
      system += own.taken[wall];
      system -= share.system;
      log_determinant += share.log_determinant + own.log_determinant[wall];
    }
    all.push_back(positive ? remaining(system, problem.unknowns, log_determinant) : Remaining{});
    double weight = all.back().positive ? std::log(prior.weight[k]) : -1e300;
    if (prior.from_data) weight += all.back().log_likelihood;
    if (!all.back().positive) weight = -std::numeric_limits<double>::infinity();
    solution.weight.push_back(weight);
    if (k == 0 || weight > best) {
      best = weight;
      solution.likeliest = k;
    }
  }
  if (!all[solution.likeliest].positive) return solution;
  solution.positive = true;
  double sum = 0;
  for (double& weight : solution.weight) sum += weight = std::exp(weight - best);
  for (double& weight : solution.weight) weight /= sum;
  const Index n = problem.unknowns;
  solution.step = Eigen::VectorXd::Zero(n);
  solution.covariance = MatrixXd::Zero(n, n);
  solution.response = MatrixXd::Zero(n, columns - n - 1);
  for (std::size_t k = 0; k < tried; ++k) {
    if (solution.weight[k] == 0) continue;
    solution.mean.sigma += solution.weight[k] * prior.parameters[k].sigma;
    solution.mean.length += solution.weight[k] * prior.parameters[k].length;
    solution.mean.white += solution.weight[k] * prior.parameters[k].white;
    solution.step += solution.weight[k] * all[k].step;
    solution.response += solution.weight[k] * all[k].response;
  }
  for (std::size_t k = 0; k < tried; ++k) {
    if (solution.weight[k] == 0) continue;
    const Eigen::VectorXd off = all[k].step - solution.step;
    solution.covariance += solution.weight[k] * (all[k].covariance + off * off.transpose());
  }
  solution.normal = all[solution.likeliest].normal;
  const ShapeParameters& likeliest = prior.parameters[solution.likeliest];
  for (std::size_t wall = 0; wall < walls; ++wall) {
    const WallGrid& grid = problem.walls[wall].grid;
    WallEquations equations = of_white[white_row(likeliest.white)].equations[wall];
    precision[wall].add_to(equations.nodes, likeliest);
    equations.nodes.factorise();
    BandMatrix::Rows right =
        equations.columns.rightCols(1) - equations.columns.leftCols(n) * solution.step;
    equations.nodes.solve_lower(right);
    Eigen::VectorXd height = right.col(0);
    equations.nodes.solve_upper(height);
    const NodeOrder order(grid);
    Eigen::VectorXd& sorted = solution.height.emplace_back(grid.nodes());
    for (Index v = 0; v <= grid.cells_v; ++v) {
      for (Index u = 0; u <= grid.cells_u; ++u) {
        sorted[v * (grid.cells_u + 1) + u] = height[order.node(u, v)];
      }
    }
  }
  return solution;
}

ShapePrior likely_part(const ShapePrior& prior, const ShapeSolution& solution) {
  constexpr double kUnlikely = 1e-3;
  require_length("weights", solution.weight.size(), prior.parameters.size());
  ShapePrior part;
  part.from_data = prior.from_data;
  double sum = 0;
  for (std::size_t k = 0; k < prior.parameters.size(); ++k) {
    if (solution.weight[k] < kUnlikely) continue;
    part.parameters.push_back(prior.parameters[k]);
    part.weight.push_back(prior.weight[k]);
    sum += prior.weight[k];
  }
  for (double& weight : part.weight) weight /= sum;
  return part;
}

}  // namespace risley::calibration
