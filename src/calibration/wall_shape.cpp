// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/wall_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <tuple>
#include <utility>

#include <Eigen/SparseCore>

#include "risley/algebra/products.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/require.hpp"
#include "risley/parallel/parallel.hpp"

#include "calibration/band_cholesky.hpp"
#include "calibration/own_unknowns.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Smoothness nu of the process, and the power nu + 1 of kappa^2 - Laplace that is its precision.
constexpr int kSmoothness = 2, kPower = kSmoothness + 1;

/// Candidates with less weight relative to the likeliest ones are skipped.
constexpr double kUnlikely = 1e-3;
/// Candidates with less weight do not change any digit of the result.
constexpr double kHopeless = 1e-15;

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
      const Eigen::SparseMatrix<double>& power = powers_[i];
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

/// One wall's part of the normal equations with its cells' own parts integrated out.
struct WallEquations {
  BandMatrix nodes;          ///< J' W J of the nodes
  BandMatrix::Rows columns;  ///< with unknowns, quantities and the residual [nodes, columns]
};

/// Integrates the own part out of every cell.
/// @param[in,out] system  less what the cells take
/// @return the wall's equations, and the log of the determinant of the cells' parts
std::pair<WallEquations, double> without_white_part(const WallSums& sums, double white,
                                                    MatrixXd& system) {
  const WallGrid& grid = sums.grid;
  const NodeOrder order(grid);
  WallEquations equations{BandMatrix(grid.nodes(), order.band()),
                          BandMatrix::Rows::Zero(grid.nodes(), sums.columns.cols())};
  const Index cells = grid.cells.size();
  MatrixXd taken(cells, sums.columns.cols());
  double log_determinant = 0;
  for (Index cell = 0; cell < cells; ++cell) {
    Eigen::Matrix3d weight = sums.weight[cell];
    auto rows = sums.columns.middleRows<3>(3 * cell).eval();
    const double all = weight(0, 0), variance = white * white;
    const double factor = variance / (1.0 + variance * all);
    log_determinant += std::log1p(variance * all);
    taken.row(cell) = std::sqrt(factor) * rows.row(0);
    const Eigen::Vector3d first = weight.col(0);
    rows -= (factor * first) * rows.row(0).eval();
    weight -= factor * first * first.transpose();
    // Heights of the four corners to height and slopes in the middle.
    const std::uint32_t number = grid.cells[cell];
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

/// Contribution of one wall to the system for some parameters of its process.
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

/// Tries the candidates of a prior starting from the likeliest one before the data, and continues
/// beside those that turn out likely: most of a grid is not worth its time.
class ShapeSearch {
 public:
  ShapeSearch(const ShapeProblem& problem, const ShapePrior& prior)
      : problem_(problem), prior_(prior), tried_(prior.parameters.size()) {
    for (const WallSums& wall : problem.walls) {
      wall.grid.empty() ? precision_.emplace_back() : precision_.emplace_back(wall.grid);
    }
  }

  ShapeSolution run() {
    std::vector<std::size_t> next{
        static_cast<std::size_t>(std::ranges::max_element(prior_.weight) - prior_.weight.begin())};
    while (!next.empty()) {
      try_all(next);
      forget_hopeless();
      next = beside_likely();
    }
    return mixture();
  }

 private:
  /// A wall's equations, and the reduction of the system by its cells' own parts.
  struct WithoutWhite {
    WallEquations equations{BandMatrix(0, 0), {}};
    MatrixXd taken;
    double log_determinant = 0;
  };
  struct Tried {
    SharedSolution result;
    std::vector<WithoutOwn> walls;
    double log_weight = -std::numeric_limits<double>::infinity();
    bool done = false;
  };

  /// The same equations serve every process with the same own part of the cells [walls].
  const std::vector<WithoutWhite>& without_white(double white) {
    const auto [at, is_new] = of_white_.try_emplace(white);
    if (is_new) {
      at->second.resize(problem_.walls.size());
      parallel::for_each(at->second.size(), [&, &all = at->second](std::size_t wall) {
        const WallSums& sums = problem_.walls[wall];
        if (sums.grid.empty()) return;
        WithoutWhite& own = all[wall];
        own.taken = MatrixXd::Zero(sums.system.rows(), sums.system.cols());
        std::tie(own.equations, own.log_determinant) = without_white_part(sums, white, own.taken);
      });
    }
    return at->second;
  }

  /// One wall without its shape and its own unknowns.
  WithoutOwn reduced(std::size_t wall, const ShapeParameters& p) const {
    const WallSums& sums = problem_.walls[wall];
    if (sums.grid.empty()) return without_own(sums.system, sums.own);
    const WithoutWhite& white = of_white_.at(p.white)[wall];
    const WallShare share = share_of(*precision_[wall], white.equations, p);
    WithoutOwn result;
    result.positive = share.positive;
    if (!share.positive) return result;
    result = without_own(sums.system + white.taken - share.system, sums.own);
    result.log_determinant += share.log_determinant + white.log_determinant;
    return result;
  }

  void try_all(const std::vector<std::size_t>& rows) {
    for (const std::size_t row : rows) without_white(prior_.parameters[row].white);
    // The remaining matrix of walls shared by many recordings is large: no more copies than threads
    // need.
    const std::size_t together =
        1 + parallel::thread_count() / std::max<std::size_t>(problem_.walls.size(), 1);
    for (std::size_t first = 0; first < rows.size(); first += together) {
      try_some({rows.data() + first, std::min(together, rows.size() - first)});
    }
  }

  void try_some(std::span<const std::size_t> rows) {
    const std::size_t walls = problem_.walls.size();
    for (const std::size_t row : rows) tried_[row].walls.resize(walls);
    parallel::for_each(rows.size() * walls, [&](std::size_t i) {
      const std::size_t row = rows[i / walls], wall = i % walls;
      tried_[row].walls[wall] = reduced(wall, prior_.parameters[row]);
    });
    for (const std::size_t row : rows) {
      Tried& own = tried_[row];
      own.done = true;
      MatrixXd system = problem_.system;
      double log_determinant = 0;
      bool positive = true;
      for (std::size_t wall = 0; wall < walls && positive; ++wall) {
        WithoutOwn& part = own.walls[wall];
        positive = part.positive;
        if (!positive) break;
        add_at(problem_.walls[wall].places, part.rest, system);
        part.rest.resize(0, 0);
        log_determinant += part.log_determinant;
      }
      if (positive) own.result = shared_solution(system, problem_.unknowns);
      if (!own.result.positive) continue;
      own.log_weight = std::log(prior_.weight[row]) -
                       0.5 * (log_determinant + own.result.log_determinant + own.result.cost);
    }
  }

  /// Candidates that add nothing to the mean are freed: for walls shared by many recordings, each
  /// keeps megabytes.
  void forget_hopeless() {
    const double least = best() + std::log(kHopeless);
    for (Tried& one : tried_) {
      if (!one.done || one.log_weight >= least) continue;
      one = {};
      one.done = true;
    }
  }

  double best() const {
    double most = -std::numeric_limits<double>::infinity();
    for (const Tried& one : tried_) most = std::max(most, one.log_weight);
    return most;
  }

  bool likely(std::size_t row) const {
    return tried_[row].done && tried_[row].log_weight > best() + std::log(kUnlikely);
  }

  /// Distance of two candidates in steps of the occurring values.
  int steps_between(const ShapeParameters& a, const ShapeParameters& b) const {
    int steps = 0;
    for (const auto member :
         {&ShapeParameters::sigma, &ShapeParameters::length, &ShapeParameters::white}) {
      std::set<double> between;
      for (const ShapeParameters& p : prior_.parameters) between.insert(p.*member);
      const auto [low, high] = std::minmax(a.*member, b.*member);
      steps += static_cast<int>(std::distance(between.find(low), between.find(high)));
    }
    return steps;
  }

  std::vector<std::size_t> beside_likely() const {
    std::vector<std::size_t> rows;
    for (std::size_t row = 0; row < tried_.size(); ++row) {
      if (tried_[row].done) continue;
      for (std::size_t other = 0; other < tried_.size(); ++other) {
        if (!likely(other) ||
            steps_between(prior_.parameters[row], prior_.parameters[other]) != 1) {
          continue;
        }
        rows.push_back(row);
        break;
      }
    }
    return rows;
  }

  ShapeSolution mixture() {
    ShapeSolution solution;
    const double most = best();
    double sum = 0;
    for (std::size_t k = 0; k < tried_.size(); ++k) {
      const double weight = std::isinf(most) ? 0.0 : std::exp(tried_[k].log_weight - most);
      solution.weight.push_back(weight);
      if (weight > solution.weight[solution.likeliest]) solution.likeliest = k;
      sum += weight;
    }
    solution.positive = sum > 0;
    if (!solution.positive) return solution;
    const Index n = problem_.unknowns, quantities = problem_.system.cols() - n - 1;
    solution.step = Eigen::VectorXd::Zero(n);
    solution.covariance = MatrixXd::Zero(n, n);
    solution.response = MatrixXd::Zero(n, quantities);
    for (std::size_t k = 0; k < tried_.size(); ++k) {
      const double weight = solution.weight[k] /= sum;
      if (weight == 0) continue;
      const ShapeParameters& p = prior_.parameters[k];
      solution.mean.sigma += weight * p.sigma;
      solution.mean.length += weight * p.length;
      solution.mean.white += weight * p.white;
      solution.step += weight * tried_[k].result.step;
      solution.response += weight * tried_[k].result.response;
    }
    for (std::size_t k = 0; k < tried_.size(); ++k) {
      if (solution.weight[k] == 0) continue;
      const Eigen::VectorXd off = tried_[k].result.step - solution.step;
      solution.covariance +=
          solution.weight[k] * (tried_[k].result.covariance + off * off.transpose());
    }
    solution.normal = tried_[solution.likeliest].result.normal;
    solution.promised =
        solution.step.dot(solution.normal.selfadjointView<Eigen::Lower>() * solution.step);
    solution.own.resize(problem_.walls.size());
    for (std::size_t wall = 0; wall < solution.own.size(); ++wall) fill_own(wall, solution);
    fill_heights(solution);
    return solution;
  }

  /// The mixture for the unknowns of one wall alone.
  void fill_own(std::size_t wall, ShapeSolution& solution) const {
    const WallSums& sums = problem_.walls[wall];
    OwnSolution& own = solution.own[wall];
    own.step = Eigen::VectorXd::Zero(sums.own);
    own.covariance = MatrixXd::Zero(sums.own, sums.own);
    own.response = MatrixXd::Zero(sums.own, solution.response.cols());
    if (sums.own == 0) return;
    std::vector<std::pair<double, Eigen::VectorXd>> steps;
    for (std::size_t k = 0; k < tried_.size(); ++k) {
      const double weight = solution.weight[k];
      if (weight == 0) continue;
      OwnSolution one = own_solution(tried_[k].walls[wall], sums.places, tried_[k].result);
      own.step += weight * one.step;
      own.covariance += weight * one.covariance;
      own.response += weight * one.response;
      steps.emplace_back(weight, std::move(one.step));
    }
    for (const auto& [weight, step] : steps) {
      const Eigen::VectorXd off = step - own.step;
      own.covariance += weight * off * off.transpose();
    }
    // The step of these unknowns against the one that follows from the step of the others.
    const Tried& likeliest = tried_[solution.likeliest];
    const WithoutOwn& part = likeliest.walls[wall];
    Eigen::VectorXd off = own.step;
    for (std::size_t j = 0; j < sums.places.size() && sums.places[j] < problem_.unknowns; ++j) {
      off += part.from_rest.col(j) * solution.step[sums.places[j]];
    }
    solution.promised += off.dot(part.normal * off);
  }

  void fill_heights(ShapeSolution& solution) {
    const ShapeParameters& p = prior_.parameters[solution.likeliest];
    const auto& white = without_white(p.white);
    solution.height.resize(problem_.walls.size());
    parallel::for_each(problem_.walls.size(), [&](std::size_t wall) {
      const WallSums& sums = problem_.walls[wall];
      const WallGrid& grid = sums.grid;
      if (grid.empty()) return;
      WallEquations equations = white[wall].equations;
      precision_[wall]->add_to(equations.nodes, p);
      equations.nodes.factorise();
      BandMatrix::Rows right = equations.columns.rightCols(1) -
                               equations.columns.leftCols(sums.own) * solution.own[wall].step;
      for (std::size_t j = 0; j < sums.places.size() && sums.places[j] < problem_.unknowns; ++j) {
        right -=
            equations.columns.col(sums.own + static_cast<Index>(j)) * solution.step[sums.places[j]];
      }
      equations.nodes.solve_lower(right);
      Eigen::VectorXd height = right.col(0);
      equations.nodes.solve_upper(height);
      const NodeOrder order(grid);
      Eigen::VectorXd& sorted = solution.height[wall];
      sorted.resize(grid.nodes());
      for (Index v = 0; v <= grid.cells_v; ++v) {
        for (Index u = 0; u <= grid.cells_u; ++u) {
          sorted[v * (grid.cells_u + 1) + u] = height[order.node(u, v)];
        }
      }
    });
  }

  const ShapeProblem& problem_;
  const ShapePrior& prior_;
  std::vector<std::optional<Precision>> precision_;       // [walls]
  std::map<double, std::vector<WithoutWhite>> of_white_;  // by the white part
  std::vector<Tried> tried_;                              // [parameters]
};

/// Sums of one length, at the system's columns.
void require_wall(const WallSums& wall, Index columns) {
  const auto size = static_cast<std::size_t>(wall.own) + wall.places.size();
  for (const Index place : wall.places) {
    require_place("column of a wall", place, columns);
  }
  require_length("rows of a wall", wall.system.rows(), size);
  require_length("columns of a wall", wall.system.cols(), size);
  if (wall.grid.empty()) return;
  require_length("cells", wall.weight.size(), wall.grid.cells.size());
  require_length("rows of cells", wall.columns.rows(), 3 * wall.grid.cells.size());
  require_length("columns of cells", wall.columns.cols(), size);
}

}  // namespace

ShapePrior typical_walls() { return {{{1.5e-3, 2.0, 0.5e-3}}, {1.0}}; }

ShapePrior building_walls() {
  constexpr double kSigmas[] = {0.3e-3, 0.6e-3, 1.2e-3, 2.4e-3, 4.8e-3, 9.6e-3};
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
  require_length("rows of the system", problem.system.rows(), columns);
  require_between("unknowns", static_cast<double>(problem.unknowns), 1,
                  static_cast<double>(columns - 1));
  require_at_least("number of parameters", prior.parameters.size(), 1);
  require_length("weights of the shape", prior.weight.size(), prior.parameters.size());
  for (const WallSums& wall : problem.walls) require_wall(wall, columns);
  return ShapeSearch(problem, prior).run();
}

ShapePrior likely_part(const ShapePrior& prior, const ShapeSolution& solution) {
  require_length("weights", solution.weight.size(), prior.parameters.size());
  ShapePrior part;
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
