// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/flight_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <fmt/format.h>

#include "risley/algebra/rotation_vector.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/calibration/planar_adjustment.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/parallel/parallel.hpp"

#include "calibration/cholesky.hpp"
#include "calibration/eigen_vectors.hpp"
#include "calibration/plane_knowledge.hpp"
#include "calibration/smooth_ground.hpp"
#include "calibration/sorted_rows.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr Index kTwo = 2 * kCorrections;
/// A long flight has converged when its corrections move by no more than this, RMS, in their
/// sigmas.
constexpr double kSettledCorrection = 0.02;
/// Columns of an inverse computed together.
constexpr Index kInverseColumns = 96;

using PlaneRows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;

std::vector<PlaneKnowledge> plane_knowledge(const FlightPriors& priors, const FlightModel& model) {
  std::vector<PlaneKnowledge> known(model.planes.size());
  for (const PlanePrior& prior : priors.planes) {
    known[prior.plane] = knowledge_of(prior, model.planes[prior.plane]);
  }
  return known;
}

/// A plane's unknowns, eliminated: with L L' of its own equations, everything times L^-1.
struct EliminatedPlane {
  Matrix3d root_inverse;             // L^-1
  Vector3d gradient;                 // L^-1 of its right side
  MatrixXd globals;                  // [3, globals]
  std::vector<std::uint32_t> knots;  // ascending
  MatrixXd by_knot;                  // [6 knots, 3]
};

/// Subtracts left own' from a block of rows x 6 entries: by far the most work of the elimination.
void subtract_product(const double* left_0, const double* left_1, const double* left_2, Index rows,
                      const Eigen::Matrix<double, kCorrections, 3>& own, double* block,
                      Index stride) {
  using Pair = Eigen::Array2d;  // knots have six rows: always an even number
  for (Index c = 0; c < kCorrections; c += 3) {
    const Pair a0 = Pair::Constant(own(c, 0)), a1 = Pair::Constant(own(c, 1)),
               a2 = Pair::Constant(own(c, 2));
    const Pair b0 = Pair::Constant(own(c + 1, 0)), b1 = Pair::Constant(own(c + 1, 1)),
               b2 = Pair::Constant(own(c + 1, 2));
    const Pair c0 = Pair::Constant(own(c + 2, 0)), c1 = Pair::Constant(own(c + 2, 1)),
               c2 = Pair::Constant(own(c + 2, 2));
    double* const first = block + c * stride;
    for (Index i = 0; i < rows; i += 2) {
      const Pair l0 = Eigen::Map<const Pair>(left_0 + i), l1 = Eigen::Map<const Pair>(left_1 + i),
                 l2 = Eigen::Map<const Pair>(left_2 + i);
      Eigen::Map<Pair>(first + i) -= l0 * a0 + l1 * a1 + l2 * a2;
      Eigen::Map<Pair>(first + stride + i) -= l0 * b0 + l1 * b1 + l2 * b2;
      Eigen::Map<Pair>(first + 2 * stride + i) -= l0 * c0 + l1 * c1 + l2 * c2;
    }
  }
}

void require_priors(const FlightPriors& priors, const FlightModel& model) {
  const auto globals = static_cast<std::size_t>(model.unknowns().size());
  require_length("mean of the priors", priors.mean.size(), globals);
  require_length("rows of the priors' information", priors.information.rows(), globals);
  require_length("columns of the priors' information", priors.information.cols(), globals);
  if (!priors.mean.allFinite() || !priors.information.allFinite()) {
    throw InvalidArgument("priors contain non-finite numbers");
  }
  require_length_or_none("held", priors.held.size(), globals);
  for (const PlanePrior& prior : priors.planes) {
    require_place("plane of a prior", prior.plane, model.planes.size());
    require_above("sigma of a plane's place", prior.sigma, 0, "m");
    for (Index i = 0; i < 3; ++i) require_finite("place of a plane", prior.place[i], "m");
    if (!prior.normal) continue;
    require_unit_length("known normal of a plane", prior.normal->norm());
    require_above("sigma of a plane's normal", prior.normal_sigma, 0, "rad");
  }
}

/// Length of a step in the global unknowns, in squared sigmas.
double promised_to_globals(const FlightSystem& system, const FlightSystem::Step& step,
                           const std::vector<bool>& held) {
  std::vector<Index> free;
  const Index globals = system.globals();
  for (Index g = 0; g < globals; ++g) {
    if (held.empty() || !held[g]) free.push_back(g);
  }
  MatrixXd units = MatrixXd::Zero(system.size(), globals);
  units.bottomRows(globals).setIdentity();
  const MatrixXd covariance = system.solve(units).bottomRows(globals)(free, free);
  const VectorXd moved = step.unknowns.tail(globals)(free);
  return moved.dot(algebra::SymmetricSolver(covariance).inverse() * moved);
}

}  // namespace

PlaneKnowledge knowledge_of(const PlanePrior& prior, const GroundPlane& plane) {
  PlaneKnowledge known;
  known.information[2] = 1 / (prior.sigma * prior.sigma);
  known.off[2] = plane.normal.dot(prior.place - plane.centre);
  if (!prior.normal) return known;
  const auto [first, second] = tangents_of(plain(plane.normal));
  const double along = prior.normal->dot(plane.normal);
  known.off[0] = prior.normal->dot(eigen(first)) / along;
  known.off[1] = prior.normal->dot(eigen(second)) / along;
  known.information.head<2>().setConstant(1 / (prior.normal_sigma * prior.normal_sigma));
  return known;
}

VectorXd unknown_values(const FlightModel& model) {
  VectorXd values = VectorXd::Zero(model.unknowns().size());
  values.head<3>() = algebra::rotation_vector(model.boresight);
  values.segment<3>(FlightUnknowns::lever_arm(0)) = model.lever_arm;
  values[FlightUnknowns::range_offset()] = model.range_offset;
  values[FlightUnknowns::clock_offset()] = model.clock_offset;
  values.segment(FlightUnknowns::parameter(0), model.free.size()) =
      estimation::free_values(model.train, model.free);
  return values;
}

MatrixXd value_rates(const FlightModel& model) {
  const Index globals = model.unknowns().size();
  MatrixXd rates = MatrixXd::Identity(globals, globals);
  const Vector3d turn = algebra::rotation_vector(model.boresight);
  const double angle = turn.norm();
  const Matrix3d across = algebra::cross_matrix(turn);
  const double factor =
      angle < 1e-4 ? 1.0 / 12
                   : 1 / (angle * angle) - (1 + std::cos(angle)) / (2 * angle * std::sin(angle));
  rates.topLeftCorner<3, 3>() = Matrix3d::Identity() + 0.5 * across + factor * across * across;
  return rates;
}

struct FlightSystem::ReducedEquations {
  Index knots = 0, globals = 0;
  std::size_t planes = 0;
  std::vector<EliminatedPlane> eliminated;
  std::vector<Index> held;  // globals
  MatrixXd held_columns;    // [size, held]: of the equations, before they were removed
  VectorXd scale;           // to a diagonal of ones
  Cholesky root;
  VectorXd right;
  MatrixXd prior;  // of the globals
  std::vector<KnotInformation> chain;

  Index size() const { return kCorrections * knots + globals; }
  Index first_global() const { return kCorrections * knots; }

  void eliminate(const FlightEquations& equations, const FlightModel& model,
                 const std::vector<PlaneKnowledge>& known);
  void reduce(MatrixXd& hessian);
  void add_priors(const FlightModel& model, const FlightPriors& priors, MatrixXd& hessian);
  void hold(const FlightPriors& priors, MatrixXd& hessian);
};

void FlightSystem::ReducedEquations::eliminate(const FlightEquations& equations,
                                               const FlightModel& model,
                                               const std::vector<PlaneKnowledge>& known) {
  const Index stride = globals + kTwo + 1 + 3;
  const SortedRows blocks(planes, equations.plane_blocks.size(),
                          [&](std::size_t i) { return equations.plane_blocks[i].plane; });
  eliminated.resize(planes);
  parallel::for_each(planes, [&](std::size_t p) {
    Matrix3d own = known[p].information.asDiagonal();
    Vector3d gradient = known[p].information.cwiseProduct(known[p].off);
    MatrixXd by_global = MatrixXd::Zero(3, globals);
    EliminatedPlane& result = eliminated[p];
    // Blocks come in the order of time: knots ascend.
    std::vector<Eigen::Matrix<double, 3, kCorrections>> by_knot;
    for (const std::size_t b : blocks.of(p)) {
      const PlaneBlock& block = equations.plane_blocks[b];
      const Eigen::Map<const PlaneRows> rows(equations.plane_products.data() + block.at, 3, stride);
      by_global += rows.leftCols(globals);
      gradient += rows.col(globals + kTwo);
      own += rows.rightCols<3>();
      const auto knot = static_cast<std::uint32_t>(model.knots.intervals[block.interval].knot);
      for (std::uint32_t k = 0; k < 2; ++k) {
        if (result.knots.empty() || result.knots.back() < knot + k) {
          result.knots.push_back(knot + k);
          by_knot.emplace_back(Eigen::Matrix<double, 3, kCorrections>::Zero());
        }
        const std::size_t at =
            result.knots.back() == knot + k ? by_knot.size() - 1 : by_knot.size() - 2;
        by_knot[at] += rows.middleCols<kCorrections>(globals + kCorrections * k);
      }
    }
    // Scaled first: a tilt of a large plane is known far better than its offset.
    const Vector3d unit = own.diagonal().cwiseSqrt().cwiseInverse();
    const Matrix3d scaled = unit.asDiagonal() * own * unit.asDiagonal();
    const Eigen::LLT<Matrix3d> root(scaled + 1e-12 * Matrix3d::Identity());
    result.root_inverse = Matrix3d::Identity();
    root.matrixL().solveInPlace(result.root_inverse);
    result.root_inverse = result.root_inverse * unit.asDiagonal();
    result.gradient = result.root_inverse * gradient;
    result.globals = result.root_inverse * by_global;
    result.by_knot.resize(kCorrections * std::ssize(by_knot), 3);
    for (std::size_t k = 0; k < by_knot.size(); ++k) {
      result.by_knot.middleRows<kCorrections>(kCorrections * k).noalias() =
          (result.root_inverse * by_knot[k]).transpose();
    }
  });
}

/// Subtracts the planes' part from the lower triangle and the right side.
void FlightSystem::ReducedEquations::reduce(MatrixXd& hessian) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> places;  // plane, its knot
  for (std::size_t p = 0; p < planes; ++p) {
    for (std::size_t k = 0; k < eliminated[p].knots.size(); ++k) {
      places.emplace_back(static_cast<std::uint32_t>(p), static_cast<std::uint32_t>(k));
    }
  }
  const SortedRows by_knot(knots, places.size(), [&](std::size_t i) {
    return eliminated[places[i].first].knots[places[i].second];
  });
  const Index g0 = first_global();
  // Each task owns the columns of one knot.
  parallel::for_each(knots, [&](Index knot) {
    const Index column = kCorrections * knot;
    for (const std::size_t i : by_knot.of(knot)) {
      const auto [p, slot] = places[i];
      const EliminatedPlane& plane = eliminated[p];
      const Eigen::Matrix<double, kCorrections, 3> own =
          plane.by_knot.middleRows<kCorrections>(kCorrections * slot);
      for (std::size_t first = slot; first < plane.knots.size();) {
        std::size_t end = first + 1;  // of consecutive knots
        while (end < plane.knots.size() && plane.knots[end] == plane.knots[end - 1] + 1) ++end;
        const auto rows = kCorrections * static_cast<Index>(end - first);
        const auto at = kCorrections * first;
        const Index row = kCorrections * plane.knots[first];
        const auto left = plane.by_knot.middleRows(at, rows);
        subtract_product(left.col(0).data(), left.col(1).data(), left.col(2).data(), rows, own,
                         &hessian(row, column), hessian.rows());
        first = end;
      }
      for (Index c = 0; c < kCorrections; ++c) {
        hessian.col(column + c).tail(globals) -= own(c, 0) * plane.globals.row(0).transpose() +
                                                 own(c, 1) * plane.globals.row(1).transpose() +
                                                 own(c, 2) * plane.globals.row(2).transpose();
      }
      right.segment<kCorrections>(column) -= own * plane.gradient;
    }
  });
  for (const EliminatedPlane& plane : eliminated) {
    hessian.bottomRightCorner(globals, globals).noalias() -=
        plane.globals.transpose().lazyProduct(plane.globals);
    right.segment(g0, globals).noalias() -= plane.globals.transpose().lazyProduct(plane.gradient);
  }
}

void FlightSystem::ReducedEquations::add_priors(const FlightModel& model,
                                                const FlightPriors& priors, MatrixXd& hessian) {
  const MatrixXd rates = value_rates(model);
  prior = rates.transpose() * priors.information * rates;
  const VectorXd off = priors.mean - unknown_values(model);
  const Index g0 = first_global();
  hessian.bottomRightCorner(globals, globals) += prior;
  right.segment(g0, globals) += rates.transpose() * (priors.information * off);
  for (int c = 0; c < kCorrections; ++c) {
    chain.push_back(knot_information(model.knots, priors.process, c, priors.breaks));
    const KnotInformation& own = chain.back();
    for (Index k = 0; k < knots; ++k) {
      const Index at = kCorrections * k + c;
      hessian(at, at) += own.diagonal[k];
      right[at] -= own.diagonal[k] * model.corrections(c, k);
      if (k + 1 == knots) continue;
      hessian(at + kCorrections, at) += own.next[k];
      right[at] -= own.next[k] * model.corrections(c, k + 1);
      right[at + kCorrections] -= own.next[k] * model.corrections(c, k);
    }
  }
}

void FlightSystem::ReducedEquations::hold(const FlightPriors& priors, MatrixXd& hessian) {
  for (std::size_t g = 0; g < priors.held.size(); ++g) {
    if (priors.held[g]) held.push_back(static_cast<Index>(g));
  }
  held_columns.resize(size(), held.size());
  for (std::size_t h = 0; h < held.size(); ++h) {
    const Index at = first_global() + held[h];
    auto column = held_columns.col(h);
    column.head(at) = hessian.row(at).head(at).transpose();
    column.tail(size() - at) = hessian.col(at).tail(size() - at);
  }
  for (const Index g : held) {
    const Index at = first_global() + g;
    hessian.row(at).head(at).setZero();
    hessian.col(at).tail(size() - at).setZero();
    hessian(at, at) = 1;
    right[at] = 0;
  }
}

FlightSystem::FlightSystem(const FlightEquations& equations, const FlightModel& model,
                           const FlightPriors& priors)
    : reduced_(std::make_unique<ReducedEquations>()) {
  require_priors(priors, model);
  require_length("globals of the equations", equations.globals, model.unknowns().size());
  require_length("intervals of the equations", equations.knot_hessian.size(),
                 model.knots.intervals.size());
  ReducedEquations& p = *reduced_;
  p.knots = std::ssize(model.knots);
  p.globals = model.unknowns().size();
  p.planes = model.planes.size();
  const Index size = p.size(), g0 = p.first_global();
  MatrixXd hessian = MatrixXd::Zero(size, size);
  p.right = VectorXd::Zero(size);
  hessian.bottomRightCorner(p.globals, p.globals) = equations.hessian;
  p.right.segment(g0, p.globals) = equations.gradient;
  for (std::size_t i = 0; i < equations.knot_hessian.size(); ++i) {
    const Index at = kCorrections * model.knots.intervals[i].knot;
    hessian.block<kTwo, kTwo>(at, at) += equations.knot_hessian[i];
    hessian.block(g0, at, p.globals, kTwo) += equations.knot_global[i].transpose();
    p.right.segment<kTwo>(at) += equations.knot_gradient[i];
  }
  p.eliminate(equations, model, plane_knowledge(priors, model));
  p.reduce(hessian);
  p.add_priors(model, priors, hessian);
  p.hold(priors, hessian);
  p.scale = algebra::unit_scale(hessian.diagonal());
  for (Index j = 0; j < size; ++j) {
    hessian.col(j).tail(size - j).array() *= p.scale[j] * p.scale.tail(size - j).array();
  }
  p.root = Cholesky(std::move(hessian));
  if (!p.root.positive()) {
    throw EstimationError(
        "the flight carries no information on some of the unknowns, and they have no priors: state "
        "sigmas, or hold the unknowns that are not to be adjusted");
  }
}

FlightSystem::FlightSystem(FlightSystem&&) noexcept = default;
FlightSystem& FlightSystem::operator=(FlightSystem&&) noexcept = default;
FlightSystem::~FlightSystem() = default;

Index FlightSystem::size() const { return reduced_->size(); }
Index FlightSystem::globals() const { return reduced_->globals; }

MatrixXd FlightSystem::solve(const MatrixXd& right) const {
  require_length("rows of the right side", right.rows(), size());
  MatrixXd solution = reduced_->scale.asDiagonal() * right;
  for (const Index g : reduced_->held) solution.row(reduced_->first_global() + g).setZero();
  reduced_->root.solve_in_place(solution);
  return reduced_->scale.asDiagonal() * solution;
}

MatrixXd FlightSystem::planes_of(const MatrixXd& solution) const {
  const ReducedEquations& p = *reduced_;
  MatrixXd result(3 * p.planes, solution.cols());
  parallel::for_each(p.planes, [&](std::size_t i) {
    const EliminatedPlane& plane = p.eliminated[i];
    MatrixXd sum = plane.globals * solution.bottomRows(p.globals);
    for (std::size_t k = 0; k < plane.knots.size(); ++k) {
      sum.noalias() += plane.by_knot.middleRows<kCorrections>(kCorrections * k).transpose() *
                       solution.middleRows<kCorrections>(kCorrections * plane.knots[k]);
    }
    result.middleRows<3>(3 * i) = -plane.root_inverse.transpose() * sum;
  });
  return result;
}

FlightSystem::Step FlightSystem::step() const {
  const ReducedEquations& p = *reduced_;
  Step step;
  step.unknowns = solve(p.right);
  step.promised = step.unknowns.dot(p.right);
  const MatrixXd followed = planes_of(step.unknowns);
  step.planes.resize(3, p.planes);
  for (std::size_t i = 0; i < p.planes; ++i) {
    step.planes.col(i) = followed.col(0).segment<3>(3 * i) +
                         p.eliminated[i].root_inverse.transpose() * p.eliminated[i].gradient;
  }
  return step;
}

FlightSystem::Band FlightSystem::inverse_band() const {
  const ReducedEquations& p = *reduced_;
  const Index n = size(), blocks = (n + kInverseColumns - 1) / kInverseColumns;
  const Index steps = kCorrections * std::max<Index>(p.knots - 1, 0);
  Band band{VectorXd::Zero(n), VectorXd::Zero(steps)};
  // Column j of L^-1 begins in row j; the inverse holds the products of its columns.
  parallel::for_each(blocks, [&](Index block) {
    const Index at = block * kInverseColumns, columns = std::min(kInverseColumns, n - at);
    const Index all = std::min(columns + kCorrections, n - at);
    MatrixXd part = MatrixXd::Zero(n - at, all);
    part.topRows(all).setIdentity();
    p.root.factor()
        .bottomRightCorner(n - at, n - at)
        .triangularView<Eigen::Lower>()
        .solveInPlace(part);
    band.diagonal.segment(at, columns) = part.leftCols(columns).colwise().squaredNorm().transpose();
    for (Index j = at; j < std::min(at + columns, steps); ++j) {
      band.next[j] = part.col(j - at).dot(part.col(j - at + kCorrections));
    }
  });
  band.diagonal = band.diagonal.cwiseProduct(p.scale.cwiseAbs2());
  band.next = band.next.cwiseProduct(
      p.scale.head(steps).cwiseProduct(p.scale.segment(kCorrections, steps)).eval());
  for (const Index g : p.held) band.diagonal[p.first_global() + g] = 0;
  return band;
}

MatrixXd FlightSystem::inverse() const { return solve(MatrixXd::Identity(size(), size())); }

MatrixXd FlightSystem::held_changes() const { return -solve(reduced_->held_columns); }

MatrixXd FlightSystem::prior_times(const MatrixXd& columns) const {
  const ReducedEquations& p = *reduced_;
  MatrixXd result = MatrixXd::Zero(size(), columns.cols());
  result.bottomRows(p.globals) = p.prior * columns.bottomRows(p.globals);
  for (int c = 0; c < kCorrections; ++c) {
    const KnotInformation& own = p.chain[c];
    for (Index k = 0; k < p.knots; ++k) {
      const Index at = kCorrections * k + c;
      result.row(at) += own.diagonal[k] * columns.row(at);
      if (k + 1 == p.knots) continue;
      result.row(at) += own.next[k] * columns.row(at + kCorrections);
      result.row(at + kCorrections) += own.next[k] * columns.row(at);
    }
  }
  return result;
}

void apply(const FlightSystem::Step& step, FlightModel& model) {
  const Index knots = std::ssize(model.knots);
  require_length("unknowns of the step", step.unknowns.size(),
                 kCorrections * knots + model.unknowns().size());
  require_length("planes of the step", step.planes.cols(), model.planes.size());
  model.corrections += Eigen::Map<const MatrixXd>(step.unknowns.data(), kCorrections, knots);
  const VectorXd own = step.unknowns.tail(model.unknowns().size());
  const Eigen::Quaterniond turned(model.boresight * algebra::rotation_by(own.head<3>()));
  model.boresight = turned.normalized().toRotationMatrix();
  model.lever_arm += own.segment<3>(FlightUnknowns::lever_arm(0));
  model.range_offset += own[FlightUnknowns::range_offset()];
  model.clock_offset += own[FlightUnknowns::clock_offset()];
  for (std::size_t j = 0; j < model.free.size(); ++j) {
    for (const int place : model.free[j].places) {
      model.train.set_place(
          place, model.train[place] + own[FlightUnknowns::parameter(static_cast<int>(j))]);
    }
  }
  for (std::size_t i = 0; i < model.planes.size(); ++i) {
    GroundPlane& plane = model.planes[i];
    const auto change = step.planes.col(i);
    const auto [first, second] = tangents_of(plain(plane.normal));
    plane.centre += change[2] * plane.normal;
    plane.normal =
        (plane.normal + change[0] * eigen(first) + change[1] * eigen(second)).normalized();
  }
}

FlightAdjustment adjust_flight(const FlightShots& shots, const ShotPoses& poses,
                               const PlaneOfShot& plane, FlightModel model,
                               const FlightWeights& weights, const FlightPriors& priors,
                               const FlightAdjustmentOptions& options, const Progress& progress) {
  require_at_least("most steps", options.most_steps, 1);
  require_not_below("tolerance", options.tolerance, 0);
  FlightAdjustment result;
  result.model = std::move(model);
  std::vector<Eigen::Matrix2d> information;  // weights hardly change it
  const auto equations_now = [&] {
    return flight_equations(shots, poses, plane, result.model, weights, options.set);
  };
  while (result.steps < options.most_steps && !result.converged) {
    progress.report(static_cast<double>(result.steps) / options.most_steps);
    if (options.smooth) {
      if (information.empty()) {
        information = tilt_information(result.model.planes.size(), equations_now());
      }
      result.model.planes = smooth_ground(result.model.planes, information);
    }
    const FlightEquations equations = equations_now();
    result.cost = equations.cost;
    result.shots = equations.shots;
    result.lost = equations.lost;
    result.outliers = equations.outliers;
    const FlightSystem system(equations, result.model, priors);
    const FlightSystem::Step step = system.step();
    if (!step.unknowns.allFinite() || !step.planes.allFinite()) {
      throw EstimationError("the adjustment of the flight diverged");
    }
    apply(step, result.model);
    ++result.steps;
    result.promised = step.promised;
    result.converged = step.promised <= options.tolerance;
    // Shots at the gate would move many corrections slightly, without end.
    if (!result.converged && result.steps == options.most_steps &&
        step.promised <= kSettledCorrection * kSettledCorrection *
                             static_cast<double>(kCorrections * result.model.knots.size())) {
      result.converged = promised_to_globals(system, step, priors.held) <= options.tolerance;
    }
  }
  return result;
}

}  // namespace risley::calibration
