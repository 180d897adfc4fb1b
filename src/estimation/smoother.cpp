// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/smoother.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

#include "estimation/knot_model.hpp"

namespace risley::estimation {
namespace {

constexpr int kMostFree = kMaxParameters;

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
    // Scaled to unit diagonal before it is inverted: units of the parameters differ by far.
    const Eigen::VectorXd scale = total.diagonal().array().rsqrt();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * total * scale.asDiagonal();
    const Eigen::LDLT<Eigen::MatrixXd> solver(scaled);
    out.parameter_covariance = scale.asDiagonal() *
                               solver.solve(Eigen::MatrixXd::Identity(free_, free_)) *
                               scale.asDiagonal();
    out.parameter_step =
        scale.asDiagonal() * solver.solve(scale.asDiagonal() * (gradient_ + prior.gradient));
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
  Affine gradient_at(std::size_t knot, const Square& curvature, const Affine& x) const {
    Affine gradient_there(d(), free_ + 1);
    gradient_there.noalias() = curvature * x;
    gradient_there = -gradient_there;
    gradient_there.col(0) += gradient(knot);
    gradient_there.rightCols(free_) -= coupling(knot);
    return gradient_there;
  }

  void forward() {
    const std::size_t knots = at_.size();
    filtered_.resize(knots * states() * static_cast<std::size_t>(free_ + 1));
    covariances_.resize(knots * states() * states());
    information_ = equations_.static_hessian;
    gradient_ = equations_.static_gradient;
    Affine x = Affine::Zero(d(), free_ + 1), e, moved(d(), free_ + 1);
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
      e = gradient_at(knot, h, x);
      moved.noalias() = p * e;
      if (free_ > 0) {
        const auto c = coupling(knot);
        information_.noalias() -= x.rightCols(free_).transpose() * e.rightCols(free_);
        information_.noalias() += c.transpose() * x.rightCols(free_);
        information_.noalias() -= e.rightCols(free_).transpose() * moved.rightCols(free_);
        gradient_.noalias() += x.rightCols(free_).transpose() * e.col(0);
        gradient_.noalias() -= c.transpose() * x.col(0);
        gradient_.noalias() += e.rightCols(free_).transpose() * moved.col(0);
      }
      x += moved;
      affine(knot) = x;
      covariance(knot) = p;
    }
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
    Vector offset = state(knot - 1);
    for (int k = 0; k < prisms(); ++k)
      advance(offset.template middleRows<3>(3 * k), step_before(knot));
    return offset - state(knot);
  }

  void predict(std::size_t knot, Affine& x, Square& p) const {
    const double dt = step_before(knot);
    for (int k = 0; k < prisms(); ++k) {
      advance(x.template middleRows<3>(3 * k), dt);
      advance(p.template middleRows<3>(3 * k), dt);
    }
    x.col(0) += step_offset(knot);
    for (int k = 0; k < prisms(); ++k) {
      advance(p.template middleCols<3>(3 * k).transpose(), dt);
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
    Vector lambda = Vector::Zero(d());
    std::size_t stretch = at_.stretch_begin.size();
    for (std::size_t knot = at_.size(); knot-- > 0;) {
      const Vector x = affine(knot) * one;
      const Vector back = covariance(knot) * lambda;
      Eigen::Map<Vector>(out.state_step.data() + knot * states(), d()) = x - back;
      if (is_stretch_begin(knot, stretch)) {
        lambda.setZero();
        continue;
      }
      const Square h = knot_curvature<N>(equations_, knot);
      Vector gradient_there = gradient(knot) - h * x;
      gradient_there -= coupling(knot) * out.parameter_step;
      lambda = lambda - h * back - gradient_there;
      const double dt = step_before(knot);
      for (int k = 0; k < prisms(); ++k) retreat(lambda.template middleRows<3>(3 * k), dt);
    }
  }

  /// As backward, with covariances: what the later knots say of a state as information Y and vector
  /// y, so that nothing is ever a small difference of large numbers.
  void backward_with_covariance(SmootherSolution& out) {
    const std::size_t triangle = states() * (states() + 1) / 2;
    out.state_covariance.resize(at_.size() * triangle);
    out.sensitivity.resize(at_.size() * states() * static_cast<std::size_t>(free_));
    Affine later = Affine::Zero(d(), free_ + 1), smoothed(d(), free_ + 1), x;
    Square information = Square::Zero(d(), d());
    std::size_t stretch = at_.stretch_begin.size();
    for (std::size_t knot = at_.size(); knot-- > 0;) {
      Square p = covariance(knot);
      x = affine(knot);
      if (!add_information(p, information)) throw not_definite(knot);
      smoothed = x + p * (later - information * x);
      const auto sensitivity = smoothed.rightCols(free_);
      Eigen::Map<Vector>(out.state_step.data() + knot * states(), d()) =
          smoothed.col(0) + sensitivity * out.parameter_step;
      Eigen::Map<Eigen::Matrix<double, kD, Eigen::Dynamic, Eigen::RowMajor>>(
          out.sensitivity.data() + knot * states() * static_cast<std::size_t>(free_), d(), free_) =
          sensitivity;
      const Square total = p + sensitivity * out.parameter_covariance * sensitivity.transpose();
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
        spread.template middleCols<3>(3 * k) +=
            information.template middleCols<3>(3 * k) *
            step_noise(process_[static_cast<std::size_t>(k)], dt);
      }
      const Eigen::PartialPivLU<Square> solver(spread);
      information = solver.solve(information).eval();
      information = (0.5 * (information + information.transpose())).eval();
      later = solver.solve(later).eval();
      later.col(0) -= information * step_offset(knot);
      for (int k = 0; k < prisms(); ++k) {
        retreat(later.template middleRows<3>(3 * k), dt);
        retreat(information.template middleRows<3>(3 * k), dt);
      }
      for (int k = 0; k < prisms(); ++k)
        retreat(information.template middleCols<3>(3 * k).transpose(), dt);
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
