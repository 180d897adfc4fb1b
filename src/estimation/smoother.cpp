// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/smoother.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>

#include "risley/algebra/products.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/parallel/parallel.hpp"

#include "estimation/knot_model.hpp"

namespace risley::estimation {
namespace {

constexpr int kMostFree = kMaxParameters;
/// Knots whose rows are multiplied together.
constexpr std::size_t kStackedKnots = 16;
/// Knots that go through the stages of a pass together, and the number of blocks in progress: a
/// stage takes some tens of microseconds.
constexpr std::size_t kStageKnots = 4 * kStackedKnots, kBlocks = 6;

/// Calls stages with blocks of the knots, each stage with one block after the other. A pass is a
/// chain of covariances, which needs no means, and a chain of means, which needs them: with two
/// threads the second runs behind the first.
/// @param blocks  kBlocks of them, with the knots [begin, end) in the order of the pass
template <class Block, class First, class Second, class Third>
void run_stages(std::size_t knots, std::vector<Block>& blocks, const First& first,
                const Second& second, const Third& third) {
  std::size_t next = 0;
  const auto choose = [&](std::size_t slot) {
    if (next == knots) return false;
    blocks[slot].begin = next;
    blocks[slot].end = next = std::min(next + kStageKnots, knots);
    return true;
  };
  const auto stage = [&](const auto& work) {
    return parallel::Stage{parallel::Stage::Order::in_turn,
                           [&](std::size_t slot) { work(blocks[slot]); }};
  };
  parallel::run_pipeline(kBlocks, choose, {stage(first), stage(second), stage(third)});
}

/// Of N rotors, which may be Eigen::Dynamic.
template <int N>
class Smoother {
  static constexpr int kD = kKnotStates<N>;
  using Square = KnotSquare<N>;
  using Vector = KnotVector<N>;
  /// Mean in the first column, derivatives by the parameters in the others.
  using Affine =
      Eigen::Matrix<double, kD, Eigen::Dynamic, Eigen::ColMajor, kMostKnotStates<N>, kMostFree + 1>;
  using AffineMap = Eigen::Map<Eigen::Matrix<double, kD, Eigen::Dynamic>>;
  using Coupling = Eigen::Map<const Eigen::Matrix<double, kD, Eigen::Dynamic, Eigen::RowMajor>>;
  /// Knots in the forward pass, with their rows of information on the parameters.
  struct AheadBlock {
    std::size_t begin = 0, end = 0;
    std::array<Eigen::MatrixXd, kStageKnots / kStackedKnots> left, right;
  };
  /// Knots in the backward pass, counted from the last: the information of the later ones on each,
  /// and the transition over the step before it.
  struct BackBlock {
    std::size_t begin = 0, end = 0;
    std::array<Square, kStageKnots> later, before_step;
    std::array<Eigen::PartialPivLU<Square>, kStageKnots> step;
  };

 public:
  Smoother(const NormalEquations& equations, const RotorTrajectory& at,
           std::span<const RotorProcess> process)
      : equations_(equations), at_(at), process_(process), free_(equations.free) {}

  SmootherSolution run(const ParameterPrior& prior, bool covariances) {
    forward();
    SmootherSolution out;
    out.parameter_information = 0.5 * (information_ + information_.transpose());
    Eigen::MatrixXd total = out.parameter_information;
    total.diagonal() += prior.information;
    const algebra::SymmetricSolver solver(total);
    out.parameter_covariance = solver.inverse();
    out.parameter_step = solver.solve(gradient_ + prior.gradient);
    if (!out.parameter_step.allFinite()) {
      throw EstimationError("the normal equations of the parameters have no finite solution");
    }
    out.state_step.resize(at_.size() * states());
    if (covariances) {
      backward_with_covariance(out);
    } else {
      backward(out);
    }
    return out;
  }

 private:
  int prisms() const { return N == Eigen::Dynamic ? at_.prisms : N; }
  int d() const { return 3 * prisms(); }
  std::size_t states() const { return static_cast<std::size_t>(d()); }
  AffineMap affine(std::size_t knot) {
    const auto columns = static_cast<std::size_t>(free_ + 1);
    return {filtered_.data() + knot * states() * columns, d(), free_ + 1};
  }
  std::size_t triangle() const { return states() * (states() + 1) / 2; }
  Square covariance(std::size_t knot) const {
    Square p(d(), d());
    const double* entry = covariances_.data() + knot * triangle();
    for (int i = 0; i < d(); ++i) {
      for (int j = i; j < d(); ++j) p(i, j) = p(j, i) = *entry++;
    }
    return p;
  }
  void keep_covariance(std::size_t knot, const Square& p) {
    double* entry = covariances_.data() + knot * triangle();
    for (int i = 0; i < d(); ++i) {
      for (int j = i; j < d(); ++j) *entry++ = p(i, j);
    }
  }
  Coupling coupling(std::size_t knot) const {
    return {equations_.coupling.data() + knot * states() * static_cast<std::size_t>(free_), d(),
            free_};
  }
  Vector gradient(std::size_t knot) const {
    return Eigen::Map<const Vector>(equations_.gradient.data() + knot * states(), d());
  }
  Vector state(std::size_t knot) const {
    return Eigen::Map<const Vector>(at_.state.data() + knot * states(), d());
  }
  double step_before(std::size_t knot) const {
    return 1e-9 * static_cast<double>(at_.time_ns[knot] - at_.time_ns[knot - 1]);
  }

  /// Gradient of the shots of a knot at affine states: (g, 0) - H x - (0, C).
  void take_gradient(std::size_t knot, const Square& curvature, const Affine& x,
                     Affine& gradient_there) const {
    const auto c = coupling(knot);
    gradient_there.col(0) = gradient(knot);
    gradient_there.rightCols(free_) = -c;
    subtract_product(curvature, x, gradient_there);
  }

  void forward() {
    const std::size_t knots = at_.size();
    filtered_.resize(knots * states() * static_cast<std::size_t>(free_ + 1));
    covariances_.resize(knots * triangle());
    shared_ = Eigen::MatrixXd::Zero(free_, free_ + 1);
    std::vector<AheadBlock> blocks(kBlocks);
    const auto rows = static_cast<Eigen::Index>(kStackedKnots) * 3 * d();
    for (AheadBlock& block : blocks) {
      block.left.fill(Eigen::MatrixXd(rows, free_));
      block.right.fill(Eigen::MatrixXd(rows, free_ + 1));
    }
    Square p(d(), d());
    Affine x = Affine::Zero(d(), free_ + 1);
    run_stages(
        knots, blocks,
        [&](AheadBlock& block) {
          for (std::size_t knot = block.begin; knot < block.end; ++knot) {
            if (begins_stretch(knot)) {
              begin_covariance(p);
            } else {
              predict_covariance(p, step_before(knot), [&](std::size_t k) { return process_[k]; });
            }
            if (!add_information(p, knot_curvature<N>(equations_, knot))) throw not_definite(knot);
            keep_covariance(knot, p);
          }
        },
        [&](AheadBlock& block) {
          Affine e(d(), free_ + 1), moved(d(), free_ + 1);
          for (std::size_t knot = block.begin; knot < block.end; ++knot) {
            begins_stretch(knot) ? begin_means(knot, x) : predict_means(knot, x);
            take_gradient(knot, knot_curvature<N>(equations_, knot), x, e);
            moved.setZero();
            add_product(covariance(knot), e, moved);
            if (free_ > 0) keep_for_sharing(knot - block.begin, x, e, moved, block);
            x += moved;
            affine(knot) = x;
          }
        },
        [&](AheadBlock& block) {
          if (free_ > 0) share(block);
        });
    information_ = equations_.static_hessian + shared_.rightCols(free_);
    gradient_ = equations_.static_gradient - shared_.col(0);
  }

  /// First row of a knot among those of its part of a block. @param place  within the block
  Eigen::Index stacked_row(std::size_t place) const {
    return static_cast<Eigen::Index>(place % kStackedKnots) * 3 * d();
  }
  /// The right side of a knot's information on the parameters, see share().
  void keep_for_sharing(std::size_t place, const Affine& x, const Affine& e, const Affine& moved,
                        AheadBlock& block) const {
    Eigen::MatrixXd& rows = block.right[place / kStackedKnots];
    for (Eigen::Index j = 0; j <= free_; ++j) {
      double* right = &rows(stacked_row(place), j);
      for (Eigen::Index i = 0; i < d(); ++i) {
        right[i] = e(i, j);
        right[d() + i] = x(i, j);
        right[2 * d() + i] = moved(i, j);
      }
    }
  }
  /// The knots' information on the parameters: (gradient, information) -= X^T (E, e) - C^T (X, x) +
  /// E^T P (E, e), as one product of many knots' rows.
  void share(AheadBlock& block) {
    for (std::size_t first = block.begin, part = 0; first < block.end;
         first += kStackedKnots, ++part) {
      const std::size_t stacked = std::min(kStackedKnots, block.end - first);
      for (std::size_t place = 0; place < stacked; ++place) {
        const auto c = coupling(first + place);
        for (Eigen::Index j = 0; j < free_; ++j) {
          const double* right = &block.right[part](stacked_row(place), j + 1);
          double* left = &block.left[part](stacked_row(place), j);
          for (Eigen::Index i = 0; i < d(); ++i) {
            left[i] = -right[d() + i];
            left[d() + i] = c(i, j);
            left[2 * d() + i] = -right[i];
          }
        }
      }
      algebra::add_transposed_product(block.left[part], block.right[part],
                                      static_cast<Eigen::Index>(stacked) * 3 * d(), shared_);
    }
  }

  void begin_covariance(Square& p) const {
    p.setZero();
    for (int k = 0; k < prisms(); ++k) {
      const RotorProcess& process = process_[static_cast<std::size_t>(k)];
      const double sigma[] = {kFirstAngleSigma, kFirstSpeedSigma,
                              first_acceleration_sigma(process)};
      for (int i = 0; i < 3; ++i) p(3 * k + i, 3 * k + i) = sigma[i] * sigma[i];
    }
  }
  void begin_means(std::size_t knot, Affine& x) const {
    x.setZero();
    for (int k = 0; k < prisms(); ++k) {
      const bool jerks = process_[static_cast<std::size_t>(k)].jerk > 0;
      if (!jerks) x(3 * k + 2, 0) = -state(knot)[3 * k + 2];
    }
  }

  /// Difference between the motion from the previous knot and a knot's linearisation: states are
  /// deviations from the linearisation, which need not follow the motion itself.
  Vector step_offset(std::size_t knot) const {
    return motion_offset(state(knot - 1), state(knot), step_before(knot));
  }

  void predict_means(std::size_t knot, Affine& x) const {
    const double dt = step_before(knot);
    for (int k = 0; k < prisms(); ++k) advance_rows(x, 3 * k, dt);
    x.col(0) += step_offset(knot);
  }

  bool begins_stretch(std::size_t knot) const {
    return std::binary_search(at_.stretch_begin.begin(), at_.stretch_begin.end(), knot);
  }

  /// Only smoothed means (modified Bryson-Frazier).
  void backward(SmootherSolution& out) {
    Eigen::VectorXd one(free_ + 1);
    one << 1.0, out.parameter_step;
    Vector lambda = Vector::Zero(d()), x(d()), back(d());
    for (std::size_t knot = at_.size(); knot-- > 0;) {
      x.setZero();
      back.setZero();
      add_product(affine(knot), one, x);
      add_product(covariance(knot), lambda, back);
      Eigen::Map<Vector>(out.state_step.data() + knot * states(), d()) = x - back;
      if (begins_stretch(knot)) {
        lambda.setZero();
        continue;
      }
      // lambda -= H back + (g - H x - C step)
      x -= back;
      add_product(knot_curvature<N>(equations_, knot), x, lambda);
      lambda -= gradient(knot);
      add_product(coupling(knot), out.parameter_step, lambda);
      const double dt = step_before(knot);
      for (int k = 0; k < prisms(); ++k) retreat_rows(lambda, 3 * k, dt);
    }
  }

  /// As backward, with covariances: information Y and vector y of the later knots on a state, so
  /// that nothing is ever a small difference of large numbers.
  void backward_with_covariance(SmootherSolution& out) {
    std::vector<BackBlock> blocks(kBlocks);
    Square information = Square::Zero(d(), d());
    Affine later = Affine::Zero(d(), free_ + 1);
    const auto each_knot = [this](BackBlock& block, const auto& work) {
      for (std::size_t i = block.begin; i < block.end; ++i) {
        work(at_.size() - 1 - i, i - block.begin);
      }
    };
    run_stages(
        at_.size(), blocks,
        [&](BackBlock& block) {
          each_knot(block, [&](std::size_t knot, std::size_t place) {
            block.later[place] = information;
            Square p = covariance(knot);
            if (!add_information(p, information)) throw not_definite(knot);
            keep_covariance(knot, p);
            retreat_information(knot, information, block.before_step[place], block.step[place]);
          });
        },
        [&](BackBlock& block) {
          Affine smoothed(d(), free_ + 1), rest(d(), free_ + 1);
          each_knot(block, [&](std::size_t knot, std::size_t place) {
            smoothed = affine(knot);
            rest = later;
            subtract_product(block.later[place], smoothed, rest);
            add_product(covariance(knot), rest, smoothed);
            affine(knot) = smoothed;
            retreat_means(knot, block.before_step[place], block.step[place], later);
          });
        },
        [&](BackBlock& block) {
          each_knot(block, [&](std::size_t knot, std::size_t) { tell_state(knot, out); });
        });
    out.state_covariance = std::move(covariances_);
    out.affine_states = std::move(filtered_);
  }

  /// Adds a knot's own shots and the noise of the step before it to the later knots' information, J
  /// := (I + J Q)^-1 J, and moves to the end of that step.
  /// @param[out] before_step  J between the two  @param[out] step  I + J Q
  void retreat_information(std::size_t knot, Square& information, Square& before_step,
                           Eigen::PartialPivLU<Square>& step) const {
    if (begins_stretch(knot)) {
      information.setZero();
      return;
    }
    const double dt = step_before(knot);
    information += knot_curvature<N>(equations_, knot);
    Square spread = Square::Identity(d(), d());
    for (int k = 0; k < prisms(); ++k) {
      auto columns = spread.template middleCols<3>(3 * k);
      add_product(information.template middleCols<3>(3 * k),
                  step_noise(process_[static_cast<std::size_t>(k)], dt), columns);
    }
    step.compute(spread);
    const Square solved = step.solve(information);
    for (int i = 0; i < d(); ++i) {
      for (int j = 0; j < d(); ++j) information(i, j) = 0.5 * (solved(i, j) + solved(j, i));
    }
    before_step = information;
    for (int k = 0; k < prisms(); ++k) retreat_rows(information, 3 * k, dt);
    for (int k = 0; k < prisms(); ++k) retreat_columns(information, 3 * k, dt);
  }
  /// The same with the vectors.
  void retreat_means(std::size_t knot, const Square& before_step,
                     const Eigen::PartialPivLU<Square>& step, Affine& later) const {
    if (begins_stretch(knot)) {
      later.setZero();
      return;
    }
    later.col(0) += gradient(knot);
    later.rightCols(free_) -= coupling(knot);
    const Affine rest = step.solve(later);
    later = rest;
    Vector moved = Vector::Zero(d());
    add_product(before_step, step_offset(knot), moved);
    later.col(0) -= moved;
    for (int k = 0; k < prisms(); ++k) retreat_rows(later, 3 * k, step_before(knot));
  }

  /// Steps of a knot's states, and their covariance with that of the parameters.
  void tell_state(std::size_t knot, SmootherSolution& out) {
    const AffineMap smoothed = affine(knot);
    const auto sensitivity = smoothed.rightCols(free_);
    Vector step = smoothed.col(0);
    add_product(sensitivity, out.parameter_step, step);
    Eigen::Map<Vector>(out.state_step.data() + knot * states(), d()) = step;
    Affine spread_parameters = Affine::Zero(d(), free_);
    add_product(sensitivity, out.parameter_covariance, spread_parameters);
    Square total = covariance(knot);
    add_product(spread_parameters, sensitivity.transpose(), total);
    for (int i = 0; i < d(); ++i) {
      for (int j = i; j < d(); ++j) total(i, j) = 0.5 * (total(i, j) + total(j, i));
    }
    keep_covariance(knot, total);
  }

  EstimationError not_definite(std::size_t knot) const {
    return EstimationError(
        fmt::format("the rotors' covariance is not positive definite at {:.6f} s",
                    1e-9 * static_cast<double>(at_.time_ns[knot] - at_.time_ns[0])));
  }

  const NormalEquations& equations_;
  const RotorTrajectory& at_;
  std::span<const RotorProcess> process_;
  Eigen::Index free_;
  /// After each knot's shots, then after all shots.
  std::vector<double> filtered_, covariances_;
  Eigen::MatrixXd shared_;  ///< the knots' information on the parameters
  Eigen::MatrixXd information_;
  Eigen::VectorXd gradient_;
};

}  // namespace

SmootherSolution smooth(const NormalEquations& equations, const RotorTrajectory& linearisation,
                        std::span<const RotorProcess> process, const ParameterPrior& prior,
                        bool covariances) {
  require_between("number of prisms", linearisation.prisms, 1, kMaxPrisms);
  if (process.size() != static_cast<std::size_t>(linearisation.prisms)) {
    throw InvalidArgument(fmt::format("process noise for {} rotors given, the train has {}",
                                      process.size(), linearisation.prisms));
  }
  const std::size_t states = linearisation.size() * 3 * process.size();
  require_length("gradient", equations.gradient.size(), states);
  require_length("state", linearisation.state.size(), states);
  require_length("prior information", static_cast<std::size_t>(prior.information.size()),
                 static_cast<std::size_t>(equations.free));
  require_length("prior gradient", static_cast<std::size_t>(prior.gradient.size()),
                 static_cast<std::size_t>(equations.free));
  // Compiling one for every number takes minutes; nearly every sensor has two.
  if (linearisation.prisms == 2) {
    return Smoother<2>(equations, linearisation, process).run(prior, covariances);
  }
  return Smoother<Eigen::Dynamic>(equations, linearisation, process).run(prior, covariances);
}

}  // namespace risley::estimation
