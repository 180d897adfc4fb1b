// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/smoother.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <fmt/format.h>

#include "risley/core/error.hpp"

#include "estimation/knot_model.hpp"

namespace risley::estimation {
namespace {

constexpr int kMostFree = kMaxParameters;

template <int N>
class Smoother {
  static constexpr int kD = 3 * N;
  using Square = Eigen::Matrix<double, kD, kD>;
  using Vector = Eigen::Matrix<double, kD, 1>;
  /// Mean in the first column, derivatives by the parameters in the others.
  using Affine = Eigen::Matrix<double, kD, Eigen::Dynamic, Eigen::ColMajor, kD, kMostFree + 1>;
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
    out.state_step.resize(at_.size() * kD);
    if (covariances) {
      backward_with_covariance(out);
    } else {
      backward(out);
    }
    return out;
  }

 private:
  AffineMap affine(std::size_t knot) {
    const auto columns = static_cast<std::size_t>(free_ + 1);
    return {filtered_.data() + knot * kD * columns, kD, free_ + 1};
  }
  SquareMap covariance(std::size_t knot) { return SquareMap(covariances_.data() + knot * kD * kD); }
  Coupling coupling(std::size_t knot) const {
    return {equations_.coupling.data() + knot * kD * static_cast<std::size_t>(free_), kD, free_};
  }
  Vector gradient(std::size_t knot) const {
    return Eigen::Map<const Vector>(equations_.gradient.data() + knot * kD);
  }
  Vector state(std::size_t knot) const {
    return Eigen::Map<const Vector>(at_.state.data() + knot * kD);
  }
  double step_before(std::size_t knot) const {
    return 1e-9 * static_cast<double>(at_.time_ns[knot] - at_.time_ns[knot - 1]);
  }

  /// Gradient of the shots of a knot at affine states: (g, 0) - H x - (0, C).
  Affine gradient_at(std::size_t knot, const Square& curvature, const Affine& x) const {
    Affine gradient_there(kD, free_ + 1);
    gradient_there.noalias() = curvature * x;
    gradient_there = -gradient_there;
    gradient_there.col(0) += gradient(knot);
    gradient_there.rightCols(free_) -= coupling(knot);
    return gradient_there;
  }

  void forward() {
    const std::size_t knots = at_.size();
    filtered_.resize(knots * kD * static_cast<std::size_t>(free_ + 1));
    covariances_.resize(knots * kD * kD);
    information_ = equations_.static_hessian;
    gradient_ = equations_.static_gradient;
    Affine x = Affine::Zero(kD, free_ + 1), e, moved(kD, free_ + 1);
    Square p;
    std::size_t stretch = 0;
    for (std::size_t knot = 0; knot < knots; ++knot) {
      if (stretch < at_.stretch_begin.size() && at_.stretch_begin[stretch] == knot) {
        ++stretch;
        begin(knot, x, p);
      } else {
        predict(knot, x, p);
      }
      const Square h = knot_curvature<N>(equations_, knot);
      if (!add_information<kD>(p, h)) throw not_definite(knot);
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
    for (int k = 0; k < N; ++k) {
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
    for (int k = 0; k < N; ++k) advance(offset.template middleRows<3>(3 * k), step_before(knot));
    return offset - state(knot);
  }

  void predict(std::size_t knot, Affine& x, Square& p) const {
    const double dt = step_before(knot);
    for (int k = 0; k < N; ++k) {
      advance(x.template middleRows<3>(3 * k), dt);
      advance(p.template middleRows<3>(3 * k), dt);
    }
    x.col(0) += step_offset(knot);
    for (int k = 0; k < N; ++k) {
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
    Vector lambda = Vector::Zero();
    std::size_t stretch = at_.stretch_begin.size();
    for (std::size_t knot = at_.size(); knot-- > 0;) {
      const Vector x = affine(knot) * one;
      const Vector back = covariance(knot) * lambda;
      Eigen::Map<Vector>(out.state_step.data() + knot * kD) = x - back;
      if (is_stretch_begin(knot, stretch)) {
        lambda.setZero();
        continue;
      }
      const Square h = knot_curvature<N>(equations_, knot);
      Vector gradient_there = gradient(knot) - h * x;
      gradient_there -= coupling(knot) * out.parameter_step;
      lambda = lambda - h * back - gradient_there;
      const double dt = step_before(knot);
      for (int k = 0; k < N; ++k) retreat(lambda.template middleRows<3>(3 * k), dt);
    }
  }

  /// As backward, with covariances: what the later knots say of a state as information Y and vector
  /// y, so that nothing is ever a small difference of large numbers.
  void backward_with_covariance(SmootherSolution& out) {
    constexpr std::size_t kTriangle = kD * (kD + 1) / 2;
    out.state_covariance.resize(at_.size() * kTriangle);
    out.sensitivity.resize(at_.size() * kD * static_cast<std::size_t>(free_));
    Affine later = Affine::Zero(kD, free_ + 1), smoothed(kD, free_ + 1), x;
    Square information = Square::Zero();
    std::size_t stretch = at_.stretch_begin.size();
    for (std::size_t knot = at_.size(); knot-- > 0;) {
      Square p = covariance(knot);
      x = affine(knot);
      if (!add_information<kD>(p, information)) throw not_definite(knot);
      smoothed = x + p * (later - information * x);
      const auto sensitivity = smoothed.rightCols(free_);
      Eigen::Map<Vector>(out.state_step.data() + knot * kD) =
          smoothed.col(0) + sensitivity * out.parameter_step;
      Eigen::Map<Eigen::Matrix<double, kD, Eigen::Dynamic, Eigen::RowMajor>>(
          out.sensitivity.data() + knot * kD * static_cast<std::size_t>(free_), kD, free_) =
          sensitivity;
      const Square total = p + sensitivity * out.parameter_covariance * sensitivity.transpose();
      double* entry = out.state_covariance.data() + knot * kTriangle;
      for (int i = 0; i < kD; ++i) {
        for (int j = i; j < kD; ++j) *entry++ = 0.5 * (total(i, j) + total(j, i));
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
      Square spread = Square::Identity();
      for (int k = 0; k < N; ++k) {
        spread.template middleCols<3>(3 * k) +=
            information.template middleCols<3>(3 * k) *
            step_noise(process_[static_cast<std::size_t>(k)], dt);
      }
      const Eigen::PartialPivLU<Square> solver(spread);
      information = solver.solve(information).eval();
      information = (0.5 * (information + information.transpose())).eval();
      later = solver.solve(later).eval();
      later.col(0) -= information * step_offset(knot);
      for (int k = 0; k < N; ++k) {
        retreat(later.template middleRows<3>(3 * k), dt);
        retreat(information.template middleRows<3>(3 * k), dt);
      }
      for (int k = 0; k < N; ++k)
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
  if (process.size() != static_cast<std::size_t>(linearisation.prisms)) {
    throw InvalidArgument(fmt::format("process noise for {} rotors given, the train has {}",
                                      process.size(), linearisation.prisms));
  }
  return with_prism_count(linearisation.prisms, [&]<int N>() {
    return Smoother<N>(equations, linearisation, process).run(prior, covariances);
  });
}

}  // namespace risley::estimation
