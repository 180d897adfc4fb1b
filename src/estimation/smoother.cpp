// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/smoother.hpp"

#include <cmath>

#include <Eigen/LU>
#include <fmt/format.h>

#include "risley/algebra/products.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

#include "estimation/knot_model.hpp"

namespace risley::estimation {
namespace {

constexpr int kMostFree = kMaxParameters;
/// Knots whose rows are multiplied at once.
constexpr Eigen::Index kStackedKnots = 16;

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
  using SquareMap = Eigen::Map<Square>;
  using Coupling = Eigen::Map<const Eigen::Matrix<double, kD, Eigen::Dynamic, Eigen::RowMajor>>;

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
  SquareMap covariance(std::size_t knot) {
    return SquareMap(covariances_.data() + knot * states() * states(), d(), d());
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
    covariances_.resize(knots * states() * states());
    shared_ = Eigen::MatrixXd::Zero(free_, free_ + 1);
    left_.resize(kStackedKnots * 3 * d(), free_);
    right_.resize(kStackedKnots * 3 * d(), free_ + 1);
    stacked_ = 0;
    Affine x = Affine::Zero(d(), free_ + 1), e(d(), free_ + 1), moved(d(), free_ + 1);
    Square p(d(), d());
    std::size_t stretch = 0;
    for (std::size_t knot = 0; knot < knots; ++knot) {
      if (stretch < at_.stretch_begin.size() && at_.stretch_begin[stretch] == knot) {
        ++stretch;
        begin(knot, x, p);
      } else {
        predict(knot, x, p);
      }
      const Square h = knot_curvature<N>(equations_, knot);
      if (!add_information(p, h)) throw not_definite(knot);
      take_gradient(knot, h, x, e);
      moved.setZero();
      add_product(p, e, moved);
      if (free_ > 0) share(knot, x, e, moved);
      x += moved;
      affine(knot) = x;
      covariance(knot) = p;
    }
    add_shared();
    information_ = equations_.static_hessian + shared_.rightCols(free_);
    gradient_ = equations_.static_gradient - shared_.col(0);
  }

  /// What a knot tells of the parameters: (gradient, information) -= X^T (E, e) - C^T (X, x) +
  /// E^T P (E, e), as one product of many knots' rows.
  void share(std::size_t knot, const Affine& x, const Affine& e, const Affine& moved) {
    const auto c = coupling(knot);
    for (Eigen::Index j = 0; j < free_; ++j) {
      double* left = &left_(stacked_, j);
      for (Eigen::Index i = 0; i < d(); ++i) {
        left[i] = -x(i, j + 1);
        left[d() + i] = c(i, j);
        left[2 * d() + i] = -e(i, j + 1);
      }
    }
    for (Eigen::Index j = 0; j <= free_; ++j) {
      double* right = &right_(stacked_, j);
      for (Eigen::Index i = 0; i < d(); ++i) {
        right[i] = e(i, j);
        right[d() + i] = x(i, j);
        right[2 * d() + i] = moved(i, j);
      }
    }
    stacked_ += 3 * d();
    if (stacked_ == left_.rows()) add_shared();
  }
  void add_shared() {
    algebra::add_transposed_product(left_, right_, stacked_, shared_);
    stacked_ = 0;
  }

  void begin(std::size_t knot, Affine& x, Square& p) const {
    x.setZero();
    p.setZero();
    for (int k = 0; k < prisms(); ++k) {
      const RotorProcess& process = process_[static_cast<std::size_t>(k)];
      const double sigma[] = {kFirstAngleSigma, kFirstSpeedSigma,
                              first_acceleration_sigma(process)};
      for (int i = 0; i < 3; ++i) p(3 * k + i, 3 * k + i) = sigma[i] * sigma[i];
      if (!(process.jerk > 0)) x(3 * k + 2, 0) = -state(knot)[3 * k + 2];
    }
  }

  /// Where the motion from the knot before misses a knot's linearisation: states are deviations
  /// from the linearisation, which need not follow the motion itself.
  Vector step_offset(std::size_t knot) const {
    return motion_offset(state(knot - 1), state(knot), step_before(knot));
  }

  void predict(std::size_t knot, Affine& x, Square& p) const {
    const double dt = step_before(knot);
    for (int k = 0; k < prisms(); ++k) {
      advance_rows(x, 3 * k, dt);
      advance_rows(p, 3 * k, dt);
    }
    x.col(0) += step_offset(knot);
    for (int k = 0; k < prisms(); ++k) {
      advance_columns(p, 3 * k, dt);
      p.template block<3, 3>(3 * k, 3 * k) += step_noise(process_[static_cast<std::size_t>(k)], dt);
    }
  }

  bool is_stretch_begin(std::size_t knot, std::size_t& stretch) const {
    if (stretch == 0 || at_.stretch_begin[stretch - 1] != knot) return false;
    --stretch;
    return true;
  }

  /// Smoothed means alone (modified Bryson-Frazier).
  void backward(SmootherSolution& out) {
    Eigen::VectorXd one(free_ + 1);
    one << 1.0, out.parameter_step;
    Vector lambda = Vector::Zero(d()), x(d()), back(d());
    std::size_t stretch = at_.stretch_begin.size();
    for (std::size_t knot = at_.size(); knot-- > 0;) {
      x.setZero();
      back.setZero();
      add_product(affine(knot), one, x);
      add_product(covariance(knot), lambda, back);
      Eigen::Map<Vector>(out.state_step.data() + knot * states(), d()) = x - back;
      if (is_stretch_begin(knot, stretch)) {
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

  /// As backward, with covariances: what the later knots say of a state as information Y and vector
  /// y, so that nothing is ever a small difference of large numbers.
  void backward_with_covariance(SmootherSolution& out) {
    const std::size_t triangle = states() * (states() + 1) / 2;
    out.state_covariance.resize(at_.size() * triangle);
    out.sensitivity.resize(at_.size() * states() * static_cast<std::size_t>(free_));
    Affine later = Affine::Zero(d(), free_ + 1), smoothed(d(), free_ + 1), rest(d(), free_ + 1);
    Affine spread_parameters(d(), free_);
    Square information = Square::Zero(d(), d());
    std::size_t stretch = at_.stretch_begin.size();
    for (std::size_t knot = at_.size(); knot-- > 0;) {
      Square p = covariance(knot);
      if (!add_information(p, information)) throw not_definite(knot);
      smoothed = affine(knot);
      rest = later;
      subtract_product(information, smoothed, rest);
      add_product(p, rest, smoothed);
      const auto sensitivity = smoothed.rightCols(free_);
      Vector step = smoothed.col(0);
      add_product(sensitivity, out.parameter_step, step);
      Eigen::Map<Vector>(out.state_step.data() + knot * states(), d()) = step;
      Eigen::Map<Eigen::Matrix<double, kD, Eigen::Dynamic, Eigen::RowMajor>>(
          out.sensitivity.data() + knot * states() * static_cast<std::size_t>(free_), d(), free_) =
          sensitivity;
      spread_parameters.setZero();
      add_product(sensitivity, out.parameter_covariance, spread_parameters);
      Square total = p;
      add_product(spread_parameters, sensitivity.transpose(), total);
      double* entry = out.state_covariance.data() + knot * triangle;
      for (int i = 0; i < d(); ++i) {
        for (int j = i; j < d(); ++j) *entry++ = 0.5 * (total(i, j) + total(j, i));
      }
      if (is_stretch_begin(knot, stretch)) {
        later.setZero();
        information.setZero();
        continue;
      }
      // This knot's own shots, then the noise of the step before it: J := (I + J Q)^-1 J.
      const double dt = step_before(knot);
      information += knot_curvature<N>(equations_, knot);
      later.col(0) += gradient(knot);
      later.rightCols(free_) -= coupling(knot);
      Square spread = Square::Identity(d(), d());
      for (int k = 0; k < prisms(); ++k) {
        auto columns = spread.template middleCols<3>(3 * k);
        add_product(information.template middleCols<3>(3 * k),
                    step_noise(process_[static_cast<std::size_t>(k)], dt), columns);
      }
      const Eigen::PartialPivLU<Square> solver(spread);
      const Square solved = solver.solve(information);
      for (int i = 0; i < d(); ++i) {
        for (int j = 0; j < d(); ++j) information(i, j) = 0.5 * (solved(i, j) + solved(j, i));
      }
      rest = solver.solve(later);
      later = rest;
      Vector moved = Vector::Zero(d());
      add_product(information, step_offset(knot), moved);
      later.col(0) -= moved;
      for (int k = 0; k < prisms(); ++k) {
        retreat_rows(later, 3 * k, dt);
        retreat_rows(information, 3 * k, dt);
      }
      for (int k = 0; k < prisms(); ++k) retreat_columns(information, 3 * k, dt);
    }
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
  std::vector<double> filtered_, covariances_;  ///< after each knot's shots
  Eigen::MatrixXd shared_;                      ///< what the knots tell of the parameters
  Eigen::MatrixXd left_, right_;                ///< rows of knots that wait to be added to it
  Eigen::Index stacked_ = 0;
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
