// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/rotor_process.hpp"

#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

namespace risley::estimation::rotor_process_test {

Eigen::Matrix3d matrix(const RotorProcess& process, double dt) {
  const RotorStepCovariance q = step_covariance(process, dt);
  Eigen::Matrix3d m;
  m << q.angle_angle, q.angle_speed, q.angle_acceleration,  //
      q.angle_speed, q.speed_speed, q.speed_acceleration,   //
      q.angle_acceleration, q.speed_acceleration, q.acceleration_acceleration;
  return m;
}

Eigen::Matrix3d transition(double dt) {
  Eigen::Matrix3d f;
  f << 1.0, dt, 0.5 * dt * dt, 0.0, 1.0, dt, 0.0, 0.0, 1.0;
  return f;
}

/// Size of the entries of Q: what rounding is relative to, where terms of a law cancel.
Eigen::Matrix3d size(const RotorProcess& process, double dt) {
  const Eigen::Vector3d sigma = matrix(process, dt).diagonal().cwiseSqrt();
  return sigma * sigma.transpose();
}

void expect_near(const Eigen::Matrix3d& found, const Eigen::Matrix3d& expected,
                 const Eigen::Matrix3d& scale) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      EXPECT_LE(std::abs(found(i, j) - expected(i, j)), 1e-14 * scale(i, j)) << i << " " << j;
    }
  }
}

struct NamedProcess {
  const char* name;
  RotorProcess process;
};

const std::vector<NamedProcess>& processes() {
  static const std::vector<NamedProcess> all{{"acceleration", {0.03, 0.0, 0.0}},
                                             {"angle walk", {0.0, 2e-4, 0.0}},
                                             {"jerk", {0.0, 0.0, 1.7}},
                                             {"all", {0.03, 2e-4, 1.7}}};
  return all;
}

TEST(RotorProcess, AStepOfTwoPartsAddsWhatBothPartsAdd) {
  for (const auto& [name, process] : processes()) {
    SCOPED_TRACE(name);
    for (const double a : {1e-5, 0.002, 0.3, 4.0}) {
      for (const double b : {3e-5, 0.002, 0.7}) {
        for (const double sign : {1.0, -1.0}) {
          const Eigen::Matrix3d f = transition(sign * b);
          expect_near(f * matrix(process, sign * a) * f.transpose() + matrix(process, sign * b),
                      matrix(process, sign * (a + b)), 4.0 * size(process, a + b));
        }
      }
    }
  }
}

TEST(RotorProcess, EqualsTheIntegralOfTheWhiteNoise) {
  // Gauss-Legendre of three points is exact up to the fifth power; the integrand has the fourth.
  const double place = std::sqrt(0.6);
  for (const auto& [name, process] : processes()) {
    SCOPED_TRACE(name);
    const Eigen::Vector3d intensity(process.angle_walk, process.acceleration, process.jerk);
    const Eigen::Matrix3d white = intensity.cwiseAbs2().asDiagonal();
    for (const double dt : {1e-5, 0.002, 0.7}) {
      Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
      for (const int node : {-1, 0, 1}) {
        const Eigen::Matrix3d f = transition(0.5 * dt * (1.0 + node * place));
        sum += 0.5 * dt * (node == 0 ? 8.0 / 9.0 : 5.0 / 9.0) * (f * white * f.transpose());
      }
      expect_near(matrix(process, dt), sum, size(process, dt));
    }
  }
}

TEST(RotorProcess, AStepBackIsTheStepForwardSeenFromItsEnd) {
  // x(0) = F(-dt) (x(dt) - w): the same noise, turned and carried back.
  for (const auto& [name, process] : processes()) {
    SCOPED_TRACE(name);
    for (const double dt : {1e-5, 0.002, 0.7}) {
      const Eigen::Matrix3d back = transition(-dt);
      expect_near(matrix(process, -dt), back * matrix(process, dt) * back.transpose(),
                  16.0 * size(process, dt));
      const RotorStepCovariance forward = step_covariance(process, dt);
      const RotorStepCovariance backward = step_covariance(process, -dt);
      EXPECT_EQ(backward.angle_angle, forward.angle_angle);
      EXPECT_EQ(backward.speed_speed, forward.speed_speed);
      EXPECT_EQ(backward.acceleration_acceleration, forward.acceleration_acceleration);
      EXPECT_EQ(backward.angle_acceleration, forward.angle_acceleration);
      EXPECT_EQ(backward.angle_speed, -forward.angle_speed);
      EXPECT_EQ(backward.speed_acceleration, -forward.speed_acceleration);
    }
  }
}

TEST(RotorProcess, JerkMakesStepsPositiveDefiniteAndTheOthersNeverNegative) {
  for (const auto& [name, process] : processes()) {
    SCOPED_TRACE(name);
    for (const double dt : {1e-6, 0.002, 5.0, -1e-6, -0.002, -5.0}) {
      const double step = std::abs(dt);
      // In units in which one step is 1 and the strongest noise of the three adds 1 to the angle.
      const Eigen::Vector3d unit(1.0, step, step * step);
      const Eigen::Matrix3d q = unit.asDiagonal() * matrix(process, dt) * unit.asDiagonal();
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(q / q.trace());
      EXPECT_GE(solver.eigenvalues()[0], -1e-15) << dt;
    }
  }
  // Jerk alone, in units of the step: leading minors 1/20, 1/960, 1/8640.
  const Eigen::Vector3d unit(1.0, 0.002, 0.002 * 0.002);
  const Eigen::Matrix3d q =
      unit.asDiagonal() * matrix({0.0, 0.0, 1.0}, 0.002) * unit.asDiagonal() / std::pow(0.002, 5);
  EXPECT_NEAR(q(0, 0), 1.0 / 20.0, 1e-15);
  EXPECT_NEAR((q.topLeftCorner<2, 2>().determinant()), 1.0 / 960.0, 1e-16);
  EXPECT_NEAR(q.determinant(), 1.0 / 8640.0, 1e-16);
}

TEST(RotorProcess, NoTimeAddsNothing) {
  for (const auto& [name, process] : processes()) {
    EXPECT_EQ(matrix(process, 0.0), Eigen::Matrix3d::Zero()) << name;
  }
}

}  // namespace risley::estimation::rotor_process_test
