// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <type_traits>

#include <Eigen/Core>

#include "risley/core/angle.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/estimation/rotor_trajectory.hpp"

namespace risley::estimation {

/// Uncertainty of a rotor at the first knot of a stretch, about the linearisation point: so wide
/// that it has negligible weight against the first milliseconds of data.
inline constexpr double kFirstAngleSigma = 0.5;
inline constexpr double kFirstSpeedSigma = radians_from_degrees(100.0);
inline constexpr double kFirstAccelerationSigma = radians_from_degrees(1000.0);
/// Of a rotor without jerk, whose acceleration is zero: only needed to keep covariances definite.
inline constexpr double kNoAccelerationSigma = 1e-9;

inline double first_acceleration_sigma(const RotorProcess& process) {
  return process.jerk > 0 ? kFirstAccelerationSigma : kNoAccelerationSigma;
}

/// Curvature block of two rotors at a knot: their states act on an angle as 1, t and t^2/2.
/// @param powers  sums over the knot's shots of products times t^0..4
inline Eigen::Matrix3d rotor_curvature(const double* powers) {
  Eigen::Matrix3d h;
  h << powers[0], powers[1], 0.5 * powers[2],  //
      powers[1], powers[2], 0.5 * powers[3],   //
      0.5 * powers[2], 0.5 * powers[3], 0.25 * powers[4];
  return h;
}

/// Of the states of N rotors at a knot; N = Eigen::Dynamic represents any number up to kMaxPrisms
/// that is only known at run time, still without heap memory.
template <int N>
inline constexpr int kKnotStates = N == Eigen::Dynamic ? Eigen::Dynamic : 3 * N;
template <int N>
inline constexpr int kMostKnotStates = 3 * (N == Eigen::Dynamic ? kMaxPrisms : N);
template <int N>
using KnotSquare = Eigen::Matrix<double, kKnotStates<N>, kKnotStates<N>, Eigen::ColMajor,
                                 kMostKnotStates<N>, kMostKnotStates<N>>;
template <int N>
using KnotVector = Eigen::Matrix<double, kKnotStates<N>, 1, Eigen::ColMajor, kMostKnotStates<N>, 1>;

/// Curvature of all states of a knot.
template <int N>
KnotSquare<N> knot_curvature(const NormalEquations& equations, std::size_t knot) {
  const int prisms = N == Eigen::Dynamic ? equations.prisms : N;
  KnotSquare<N> h(3 * prisms, 3 * prisms);
  const auto pairs = static_cast<std::size_t>(prisms * (prisms + 1) / 2);
  const double* powers = equations.curvature.data() + knot * pairs * 5;
  for (int k = 0; k < prisms; ++k) {
    for (int l = k; l < prisms; ++l, powers += 5) {
      h.template block<3, 3>(3 * k, 3 * l) = rotor_curvature(powers);
      if (l != k) h.template block<3, 3>(3 * l, 3 * k) = rotor_curvature(powers);
    }
  }
  return h;
}

/// One rotor's three rows, from `first` on, advanced by dt: rows := F rows.
template <class Matrix>
void advance_rows(Matrix& m, Eigen::Index first, double dt) {
  for (Eigen::Index j = 0; j < m.cols(); ++j) {
    m(first, j) += dt * m(first + 1, j) + (0.5 * dt * dt) * m(first + 2, j);
    m(first + 1, j) += dt * m(first + 2, j);
  }
}
/// Difference between states advanced by dt and others: F from - to. Angles count the turns of
/// hours, so they are subtracted before anything is added: what is rounded at a million radians and
/// summed over a million knots would be as large as the sigma of a rotor that runs evenly.
template <class Vector>
Vector motion_offset(const Vector& from, const Vector& to, double dt) {
  Vector offset = from - to;
  for (Eigen::Index k = 0; k < from.size(); k += 3) {
    offset[k] += dt * (from[k + 1] + 0.5 * dt * from[k + 2]);
    offset[k + 1] += dt * from[k + 2];
  }
  return offset;
}
/// columns := columns F^T
template <class Matrix>
void advance_columns(Matrix& m, Eigen::Index first, double dt) {
  Eigen::Transpose<Matrix> turned(m);
  advance_rows(turned, first, dt);
}
/// rows := F^T rows
template <class Matrix>
void retreat_rows(Matrix& m, Eigen::Index first, double dt) {
  for (Eigen::Index j = 0; j < m.cols(); ++j) {
    m(first + 2, j) += dt * m(first + 1, j) + (0.5 * dt * dt) * m(first, j);
    m(first + 1, j) += dt * m(first, j);
  }
}
/// columns := columns F
template <class Matrix>
void retreat_columns(Matrix& m, Eigen::Index first, double dt) {
  Eigen::Transpose<Matrix> turned(m);
  retreat_rows(turned, first, dt);
}

/// Process noise of one rotor over dt.
inline Eigen::Matrix3d step_noise(const RotorProcess& process, double dt) {
  const RotorStepCovariance q = step_covariance(process, dt);
  Eigen::Matrix3d noise;
  noise << q.angle_angle, q.angle_speed, q.angle_acceleration,  //
      q.angle_speed, q.speed_speed, q.speed_acceleration,       //
      q.angle_acceleration, q.speed_acceleration, q.acceleration_acceleration;
  return noise;
}

/// The covariance of the states of all rotors, advanced by dt.
/// @param process_of  of a rotor
template <class Square, class ProcessOf>
void predict_covariance(Square& p, double dt, const ProcessOf& process_of) {
  for (Eigen::Index k = 0; k < p.rows(); k += 3) advance_rows(p, k, dt);
  for (Eigen::Index k = 0; k < p.rows(); k += 3) {
    advance_columns(p, k, dt);
    p.template block<3, 3>(k, k) += step_noise(process_of(static_cast<std::size_t>(k / 3)), dt);
  }
}

/// A column of a matrix that stays in registers while products are added to it, instead of going to
/// memory and back for each; if the number of rows has no bound, the matrix's own.
template <class Matrix>
using HeldColumn =
    std::conditional_t<Matrix::MaxRowsAtCompileTime == Eigen::Dynamic, typename Matrix::ColXpr,
                       Eigen::Matrix<double, Matrix::RowsAtCompileTime, 1, Eigen::ColMajor,
                                     Matrix::MaxRowsAtCompileTime, 1>>;

/// out += a b, column by column; out is neither a nor b. Eigen's own product of matrices this small
/// is no faster and takes seconds of compilation for every expression.
template <class A, class B, class Out>
void add_product(const A& a, const B& b, Out& out) {
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    HeldColumn<Out> column = out.col(j);
    for (Eigen::Index k = 0; k < a.cols(); ++k) column += a.col(k) * b(k, j);
    out.col(j) = column;
  }
}
/// out -= a b
template <class A, class B, class Out>
void subtract_product(const A& a, const B& b, Out& out) {
  add_product(a, -b, out);
}

/// Lower Cholesky factor, in place. Whole columns are processed: the part above the diagonal is
/// never used and becomes 0.
/// @return false when the matrix is not positive definite
template <class Square>
bool cholesky(Square& a) {
  const Eigen::Index d = a.rows();
  for (Eigen::Index j = 0; j < d; ++j) {
    HeldColumn<Square> column = a.col(j);
    for (Eigen::Index k = 0; k < j; ++k) column -= a.col(k) * a(j, k);
    if (!(column[j] > 0)) return false;
    column *= 1.0 / std::sqrt(column[j]);
    for (Eigen::Index i = 0; i < j; ++i) column[i] = 0;
    a.col(j) = column;
  }
  return true;
}

/// Updates the covariance of a prior with information H without inverting either: (P^-1 + H)^-1 = W
/// W^T with P = L L^T, I + L^T H L = R R^T, W^T = R^-1 L^T.
/// @param[out] log_determinant  of I + P H, when wanted
/// @return false when P is not positive definite
template <class Square>
bool add_information(Square& covariance, const Square& information,
                     double* log_determinant = nullptr) {
  const Eigen::Index d = covariance.rows();
  Square lower = covariance;
  if (!cholesky(lower)) return false;
  const Square upper = lower.transpose();
  Square half(d, d), inner(d, d), root(d, d);
  half.setZero();
  inner.setIdentity();
  add_product(information, lower, half);
  add_product(upper, half, inner);
  if (!cholesky(inner)) return false;
  // W, column by column: R W^T = L^T read as rows.
  for (Eigen::Index i = 0; i < d; ++i) {
    HeldColumn<Square> column = lower.col(i);
    for (Eigen::Index k = 0; k < i; ++k) column -= root.col(k) * inner(i, k);
    root.col(i) = column / inner(i, i);
  }
  const Square turned = root.transpose();
  covariance.setZero();
  add_product(root, turned, covariance);
  if (log_determinant) {
    double product = 1.0;
    for (Eigen::Index i = 0; i < d; ++i) product *= inner(i, i);
    *log_determinant = 2.0 * std::log(product);
  }
  return true;
}

}  // namespace risley::estimation
