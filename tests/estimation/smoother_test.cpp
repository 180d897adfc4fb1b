// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/smoother.hpp"

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/QR>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/optics/prism_train.hpp"

#include "estimation/knot_model.hpp"
#include "refusal.hpp"

namespace risley::estimation::smoother_test {

using Real = long double;
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

constexpr RotorProcess kWalk{radians_from_degrees(1.5), 0.0, 0.0};
constexpr RotorProcess kSwing{radians_from_degrees(0.5), 0.0, radians_from_degrees(80.0)};
constexpr RotorProcess kEverything{radians_from_degrees(3.0), 1e-5, radians_from_degrees(300.0)};

/// Shots of random slopes and residuals at linearisation states that follow no motion.
struct Problem {
  RotorTrajectory at;
  NormalEquations equations;
  ParameterPrior prior;
  std::vector<RotorProcess> process;
  Matrix rows;       ///< [2 shots][knots d + free], in sigmas
  Vector residuals;  ///< [2 shots]

  Problem(int prisms, int free, std::vector<std::size_t> stretch_begin, std::size_t knots,
          std::vector<RotorProcess> motion, unsigned seed, double gap = 0.01,
          std::size_t gap_before = 4)
      : process(std::move(motion)) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(0.5, 1.5);
    at.prisms = prisms;
    at.stretch_begin = std::move(stretch_begin);
    const auto n = static_cast<std::size_t>(prisms);
    std::int64_t time = 7'000'000'000;
    for (std::size_t knot = 0; knot < knots; ++knot) {
      time += static_cast<std::int64_t>(2e6 * uniform(generator));
      if (knot == gap_before) time += std::llround(1e9 * gap);
      if (knot > 0 && knot == at.stretch_begin.back()) time = 1'000;  // the clock was reset
      at.time_ns.push_back(time);
      for (std::size_t k = 0; k < n; ++k) {
        at.state.push_back(2.0 + 5e-3 * normal(generator));
        at.state.push_back(0.5 * normal(generator));
        at.state.push_back(30.0 * normal(generator));
      }
    }
    const std::size_t shots = 3 * knots;
    const Eigen::Index d = at.states(), states = d * static_cast<Eigen::Index>(knots);
    rows = Matrix::Zero(2 * static_cast<Eigen::Index>(shots), states + free);
    residuals = Vector::Zero(rows.rows());
    Matrix curvature =
        Matrix::Zero(prisms * (prisms + 1) / 2 * 5, static_cast<Eigen::Index>(knots));
    for (std::size_t shot = 0; shot < shots; ++shot) {
      const auto knot = static_cast<Eigen::Index>(shot / 3);
      const double t = 1e-3 * (uniform(generator) - 1.0);
      for (const int angle : {0, 1}) {
        const Eigen::Index row = 2 * static_cast<Eigen::Index>(shot) + angle;
        Vector slope(prisms);
        for (Real& value : slope) value = 2000.0 * normal(generator);
        for (Eigen::Index k = 0; k < prisms; ++k) {
          rows.row(row).segment<3>(knot * d + 3 * k) << slope[k], slope[k] * t,
              slope[k] * t * t / 2;
        }
        for (Eigen::Index j = 0; j < free; ++j) {
          rows(row, states + j) = std::pow(10.0, 4 - j) * normal(generator);
        }
        residuals[row] = 3.0 * normal(generator);
        Eigen::Index entry = 0;
        for (Eigen::Index k = 0; k < prisms; ++k) {
          for (Eigen::Index l = k; l < prisms; ++l) {
            for (int power = 0; power < 5; ++power) {
              curvature(entry++, knot) += slope[k] * slope[l] * std::pow(Real(t), power);
            }
          }
        }
      }
    }
    equations.prisms = prisms;
    equations.free = free;
    const Matrix normal_matrix = rows.transpose() * rows;
    const Vector gradient = rows.transpose() * residuals;
    for (const Real value : curvature.reshaped()) {
      equations.curvature.push_back(static_cast<double>(value));
    }
    for (Eigen::Index i = 0; i < states; ++i) {
      equations.gradient.push_back(static_cast<double>(gradient[i]));
      for (Eigen::Index j = 0; j < free; ++j) {
        equations.coupling.push_back(static_cast<double>(normal_matrix(i, states + j)));
      }
    }
    equations.static_hessian = normal_matrix.bottomRightCorner(free, free).cast<double>();
    equations.static_gradient = gradient.tail(free).cast<double>();
    prior.information.resize(free);
    prior.gradient.resize(free);
    for (Eigen::Index j = 0; j < free; ++j) {
      const double sigma = radians_from_degrees(0.1) * std::pow(10.0, static_cast<double>(j));
      prior.information[j] = 1.0 / (sigma * sigma);
      prior.gradient[j] = normal(generator) / sigma;
    }
  }
};

/// A square root of a positive semidefinite matrix.
Matrix square_root(Matrix a) {
  Matrix root = Matrix::Zero(a.rows(), a.cols());
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    if (!(a(j, j) > 0)) continue;
    root.col(j) = a.col(j) / std::sqrt(a(j, j));
    root.col(j).head(j).setZero();
    a -= root.col(j) * root.col(j).transpose();
  }
  return root;
}

/// The same minimum by one dense adjustment, in long double. Unknowns are every first state and
/// every noise term, each in its own sigma, and the parameters: the states are motion * unknowns +
/// offset, and nothing needs the inverse of a process noise, which may be singular.
struct Dense {
  Vector parameter_step, state_step;
  Matrix parameter_covariance, parameter_information, state_covariance, sensitivity;

  explicit Dense(const Problem& p) {
    const Eigen::Index d = p.at.states(), n = p.equations.free;
    const Eigen::Index states = d * static_cast<Eigen::Index>(p.at.size());
    Matrix motion = Matrix::Zero(states, states);
    Vector offset = Vector::Zero(states);
    std::size_t stretch = 0;
    for (std::size_t knot = 0; knot < p.at.size(); ++knot) {
      const bool first = stretch < p.at.stretch_begin.size() && p.at.stretch_begin[stretch] == knot;
      stretch += first;
      for (Eigen::Index k = 0; k < p.at.prisms; ++k) {
        const Eigen::Index i = static_cast<Eigen::Index>(knot) * d + 3 * k;
        const RotorProcess& process = p.process[static_cast<std::size_t>(k)];
        const double* here = p.at.state.data() + i;
        if (first) {
          motion(i, i) = kFirstAngleSigma;
          motion(i + 1, i + 1) = kFirstSpeedSigma;
          motion(i + 2, i + 2) = first_acceleration_sigma(process);
          if (process.jerk == 0) offset[i + 2] = -here[2];  // its acceleration is zero
          continue;
        }
        const double dt = 1e-9 * static_cast<double>(p.at.time_ns[knot] - p.at.time_ns[knot - 1]);
        Matrix f = Matrix::Identity(3, 3);
        f(0, 1) = f(1, 2) = dt;
        f(0, 2) = Real(dt) * dt / 2;
        const Eigen::Map<const Eigen::Vector3d> before(here - d), now(here);
        motion.middleRows(i, 3) = f * motion.middleRows(i - d, 3);
        motion.block(i, i, 3, 3) = square_root(step_noise(process, dt).cast<Real>());
        offset.segment(i, 3) =
            f * (before.cast<Real>() + offset.segment(i - d, 3)) - now.cast<Real>();
      }
    }
    // Rows of the shots, of the unknowns' own sigmas, and of the parameters' prior.
    const Eigen::Index shots = p.rows.rows();
    Matrix rows = Matrix::Zero(shots + states + n, states + n);
    Vector right = Vector::Zero(rows.rows());
    rows.topRows(shots) << p.rows.leftCols(states) * motion, p.rows.rightCols(n);
    right.head(shots) = p.residuals - p.rows.leftCols(states) * offset;
    rows.block(shots, 0, states, states).setIdentity();
    const Vector weight = p.prior.information.cast<Real>().cwiseSqrt();
    rows.bottomRightCorner(n, n) = weight.asDiagonal();
    right.tail(n) = p.prior.gradient.cast<Real>().cwiseQuotient(weight);

    const Eigen::HouseholderQR<Matrix> data(rows.topRows(shots + states));
    const Matrix triangle = data.matrixQR().topRows(states + n).triangularView<Eigen::Upper>();
    const Matrix rotors = triangle.topLeftCorner(states, states);
    sensitivity =
        -motion * rotors.triangularView<Eigen::Upper>().solve(triangle.topRightCorner(states, n));
    parameter_information =
        triangle.bottomRightCorner(n, n).transpose() * triangle.bottomRightCorner(n, n);
    const Eigen::HouseholderQR<Matrix> all(rows);
    const Vector step = all.solve(right);
    const Matrix root = all.matrixQR()
                            .topRows(states + n)
                            .triangularView<Eigen::Upper>()
                            .solve(Matrix(Matrix::Identity(states + n, states + n)));
    const Matrix state_root = motion * root.topRows(states);
    parameter_step = step.tail(n);
    parameter_covariance = root.bottomRows(n) * root.bottomRows(n).transpose();
    state_step = motion * step.head(states) + offset;
    state_covariance = state_root * state_root.transpose();
  }
};

/// Largest difference as a share of size(i) size(j).
template <class Found>
double difference(const Found& found, const Matrix& expected, const Vector& left,
                  const Vector& right) {
  EXPECT_EQ(found.rows(), expected.rows());
  EXPECT_EQ(found.cols(), expected.cols());
  Real worst = 0;
  for (Eigen::Index i = 0; i < expected.rows(); ++i) {
    for (Eigen::Index j = 0; j < expected.cols(); ++j) {
      const Real error = std::abs(found(i, j) - expected(i, j)) / (left[i] * right[j]);
      if (!(error <= worst)) worst = error;
    }
  }
  return static_cast<double>(worst);
}

void expect_dense_solution(const Problem& p) {
  // Shares of a sigma: rounding. A smoothed variance is a small difference of wider ones.
  constexpr double kTolerance = 1e-9, kStateTolerance = 1e-8, kVarianceTolerance = 2e-7;
  const Dense dense(p);
  const Vector sigma = dense.parameter_covariance.diagonal().cwiseSqrt();
  const Vector weight = dense.parameter_information.diagonal().cwiseSqrt();
  const Vector state_sigma = dense.state_covariance.diagonal().cwiseSqrt();
  const Vector one = Vector::Ones(1);
  const Eigen::Index d = p.at.states();
  for (const bool covariances : {false, true}) {
    SCOPED_TRACE(covariances ? "with covariances" : "without covariances");
    const SmootherSolution found = smooth(p.equations, p.at, p.process, p.prior, covariances);
    EXPECT_LE(difference(found.parameter_step, dense.parameter_step, sigma, one), kTolerance);
    EXPECT_LE(difference(found.parameter_covariance, dense.parameter_covariance, sigma, sigma),
              kTolerance);
    EXPECT_LE(difference(found.parameter_information, dense.parameter_information, weight, weight),
              kTolerance);
    const Eigen::Map<const Eigen::VectorXd> states(
        found.state_step.data(), static_cast<Eigen::Index>(found.state_step.size()));
    // The zero acceleration of a rotor without jerk is only as exact as what it cancels.
    const Vector state_size = state_sigma + Real(1e-6) * dense.state_step.cwiseAbs();
    EXPECT_LE(difference(states, dense.state_step, state_size, one), kStateTolerance);
    if (!covariances) {
      EXPECT_TRUE(found.state_covariance.empty());
      EXPECT_TRUE(found.affine_states.empty());
      continue;
    }
    ASSERT_EQ(found.affine_states.size(),
              p.at.state.size() * static_cast<std::size_t>(p.equations.free + 1));
    Eigen::MatrixXd sensitivity(dense.sensitivity.rows(), dense.sensitivity.cols());
    for (std::size_t knot = 0; p.equations.free > 0 && knot < p.at.size(); ++knot) {
      sensitivity.middleRows(static_cast<Eigen::Index>(knot) * d, d) = found.sensitivity(knot, d);
    }
    EXPECT_LE(difference(sensitivity, dense.sensitivity, state_sigma, sigma.cwiseInverse()),
              kStateTolerance);
    ASSERT_EQ(found.state_covariance.size(),
              p.at.size() * static_cast<std::size_t>(d * (d + 1) / 2));
    const double* entry = found.state_covariance.data();
    for (Eigen::Index knot = 0; knot < static_cast<Eigen::Index>(p.at.size()); ++knot) {
      for (Eigen::Index i = knot * d; i < (knot + 1) * d; ++i) {
        for (Eigen::Index j = i; j < (knot + 1) * d; ++j) {
          const Real scale = state_sigma[i] * state_sigma[j];
          EXPECT_LE(std::abs(*entry++ - dense.state_covariance(i, j)), kVarianceTolerance * scale)
              << "knot " << knot << ", entry " << i - knot * d << " " << j - knot * d;
        }
      }
    }
  }
}

TEST(Smoother, EqualsTheDenseSolutionOfTwoRotorsInTwoStretches) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    expect_dense_solution({2, 3, {0, 3}, 6, {kSwing, kEverything}, seed});
  }
}

TEST(Smoother, EqualsTheDenseSolutionForOtherNumbersOfPrisms) {
  expect_dense_solution({1, 3, {0, 3}, 6, {kSwing}, 11});
  expect_dense_solution({3, 2, {0, 5}, 9, {kSwing, kEverything, kSwing}, 12});
  expect_dense_solution({4, 4, {0}, 5, {kSwing, kEverything, kSwing, kSwing}, 13});
}

TEST(Smoother, EqualsTheDenseSolutionWhereRotorsHaveNoJerk) {
  // Their process noise is singular and their acceleration zero.
  expect_dense_solution({2, 3, {0, 3}, 6, {kWalk, kSwing}, 21});
  expect_dense_solution({1, 2, {0, 1}, 7, {kWalk}, 22});
}

TEST(Smoother, EqualsTheDenseSolutionWithoutParameters) {
  expect_dense_solution({2, 0, {0, 3}, 6, {kSwing, kWalk}, 31});
}

TEST(Smoother, EqualsTheDenseSolutionOverALongerRunWithAGap) {
  expect_dense_solution({2, 3, {0, 14, 15}, 40, {kSwing, kWalk}, 41, 0.1, 28});
}

// Once the variances before the gap were differences of far larger ones: the acceleration's was
// wrong several times over, with more shots even negative, and the steps were wrong by sigmas.
TEST(Smoother, ALongGapAfterFewKnotsCostsNoAccuracy) {
  for (const double gap : {1.0, 4.5}) {
    const Problem p(2, 3, {0}, 12, {kSwing, kSwing}, 5, gap, 2);
    const Dense dense(p);
    const SmootherSolution found = smooth(p.equations, p.at, p.process, p.prior, true);
    const double* entry = found.state_covariance.data();
    for (Eigen::Index i = 0; i < dense.state_step.size(); entry += 6 - i++ % 6) {
      const auto variance = static_cast<double>(dense.state_covariance(i, i));
      EXPECT_NEAR(*entry / variance, 1.0, 1e-3) << gap << " s, state " << i;
      EXPECT_NEAR(found.state_step[static_cast<std::size_t>(i)],
                  static_cast<double>(dense.state_step[i]), 1e-3 * std::sqrt(variance))
          << gap << " s, state " << i;
    }
  }
}

// A rotor that turns evenly is known better than what is rounded in its angle, summed over the
// knots: after an hour of shots steps of a sigma came and went, and the estimate never settled.
TEST(Smoother, ManyTurnsOfAnEvenRotorCostNoAccuracy) {
  constexpr std::size_t kKnots = 20000;
  constexpr double kSpeed = 400, kFirstAngle = 1e9;  // rounded to 1.2e-7 rad
  RotorTrajectory at;
  at.prisms = 1;
  at.stretch_begin = {0};
  NormalEquations equations;
  equations.prisms = equations.free = 1;
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  std::vector<Real> off;  // of the linearisation from the truth
  for (std::size_t knot = 0; knot < kKnots; ++knot) {
    const Real truth = kFirstAngle + kSpeed * 2e-3L * static_cast<Real>(knot);
    at.time_ns.push_back(2'000'000 * static_cast<std::int64_t>(knot));
    at.state.push_back(static_cast<double>(truth) + 1e-5 * normal(generator));
    at.state.push_back(kSpeed + 1e-3 * normal(generator));
    at.state.push_back(0);
    off.push_back(at.state[3 * knot] - truth);
    constexpr double kInformation = 1e8;
    for (const double power : {kInformation, 0.0, 0.0, 0.0, 0.0}) {
      equations.curvature.push_back(power);
    }
    equations.gradient.push_back(-kInformation * static_cast<double>(off.back()));
    equations.gradient.insert(equations.gradient.end(), {0.0, 0.0});
  }
  equations.coupling.assign(3 * kKnots, 0.0);
  equations.static_hessian = Eigen::MatrixXd::Ones(1, 1);
  equations.static_gradient = Eigen::VectorXd::Zero(1);
  const ParameterPrior prior{Eigen::VectorXd::Ones(1), Eigen::VectorXd::Zero(1)};
  const std::vector<RotorProcess> even{{radians_from_degrees(1e-6), 0.0, 0.0}};
  for (const bool covariances : {false, true}) {
    const SmootherSolution found = smooth(equations, at, even, prior, covariances);
    double squares = 0, variances = 0;
    for (std::size_t knot = 0; knot < kKnots; ++knot) {
      const auto left = static_cast<double>(off[knot] + found.state_step[3 * knot]);
      squares += left * left;
      if (covariances) variances += found.state_covariance[6 * knot];
    }
    EXPECT_LT(std::sqrt(squares / kKnots), 1e-7);
    if (!covariances) continue;
    EXPECT_NEAR(std::sqrt(variances / kKnots), 1.1e-6, 4e-7);
  }
}

TEST(Smoother, RotorsWithoutJerkEndWithoutAcceleration) {
  const Problem p(2, 3, {0, 3}, 6, {kWalk, kSwing}, 51);
  const SmootherSolution found = smooth(p.equations, p.at, p.process, p.prior, true);
  for (std::size_t knot = 0; knot < p.at.size(); ++knot) {
    EXPECT_NEAR(p.at.state_of(knot)[2] + found.state_step[6 * knot + 2], 0.0, 1e-12);
    EXPECT_GT(std::abs(p.at.state_of(knot)[5] + found.state_step[6 * knot + 5]), 1e-3);
  }
}

TEST(Smoother, SaysWhereACovarianceIsNotPositiveDefinite) {
  Problem p(1, 2, {0}, 6, {kSwing}, 71);
  p.at.time_ns = {0, 2'000'000, 4'000'000, 6'000'000, 8'000'000, 10'000'000};
  p.equations.curvature[3 * 5] = std::nan("");
  EXPECT_THAT(
      refusal<EstimationError>([&] { smooth(p.equations, p.at, p.process, p.prior, false); }),
      ::testing::HasSubstr("at 0.006000 s"));
}

}  // namespace risley::estimation::smoother_test
