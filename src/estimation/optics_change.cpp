// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation/optics_change.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "risley/algebra/distributions.hpp"
#include "risley/algebra/symmetric.hpp"

namespace risley::estimation {
namespace {

using Eigen::Index;

/// A combination that keeps more of its prior variance than this was not measured.
constexpr double kMostPriorVariance = 0.3 * 0.3;

/// Orthonormal columns: the measured combinations according to a covariance.
Eigen::MatrixXd measured_combinations(const Eigen::MatrixXd& covariance) {
  const algebra::PrincipalAxes axes = algebra::principal_axes(covariance);
  const auto count = std::count_if(axes.values.begin(), axes.values.end(),
                                   [](double v) { return v < kMostPriorVariance; });
  return axes.vectors.leftCols(count);
}

/// Shorter parts of a constant in the measured space are rounding.
constexpr double kLeastMeasured = 1e-3;

/// Probability that chi-squared, over a variance factor estimated from the scatter of pieces,
/// exceeds a value.
double tail(double chi2, double combinations, const PieceScatter& scatter) {
  if (scatter.variance_factor > 1 && scatter.degrees_of_freedom > 0) {
    return algebra::f_tail(chi2, combinations, scatter.degrees_of_freedom);
  }
  return algebra::chi_square_tail(chi2, combinations);
}

}  // namespace

ConstantsEstimate pooled(const std::deque<ConstantsEstimate>& pieces, std::size_t newest) {
  const Index n = pieces.back().mean.size();
  Eigen::MatrixXd information = Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd vector = Eigen::VectorXd::Zero(n);
  for (std::size_t i = pieces.size() - std::min(newest, pieces.size()); i < pieces.size(); ++i) {
    const Eigen::MatrixXd own = algebra::SymmetricSolver(pieces[i].covariance).inverse();
    information += own - Eigen::MatrixXd::Identity(n, n);
    vector += own * pieces[i].mean;
  }
  const algebra::SymmetricSolver solver(information);
  return {solver.solve(vector), solver.inverse()};
}

PieceScatter piece_scatter(const std::deque<ConstantsEstimate>& pieces) {
  PieceScatter result;
  if (pieces.size() < 2) return result;
  const Eigen::VectorXd mean = pooled(pieces, pieces.size()).mean;
  // Every piece must have measured them: the worst of all covariances decides.
  Eigen::MatrixXd worst = pieces.front().covariance;
  for (const ConstantsEstimate& piece : pieces) {
    if (piece.covariance.trace() > worst.trace()) worst = piece.covariance;
  }
  const Eigen::MatrixXd measured = measured_combinations(worst);
  if (measured.cols() == 0) return result;
  double chi2 = 0;
  for (const ConstantsEstimate& piece : pieces) {
    const Eigen::VectorXd off = measured.transpose() * (piece.mean - mean);
    chi2 += algebra::SymmetricSolver(measured.transpose() * piece.covariance * measured).chi2(off);
  }
  result.degrees_of_freedom =
      static_cast<double>(measured.cols()) * static_cast<double>(pieces.size() - 1);
  result.variance_factor = std::max(1.0, chi2 / result.degrees_of_freedom);
  return result;
}

ConstantsDifference difference_of(const ConstantsEstimate& a, const ConstantsEstimate& b,
                                  const Eigen::MatrixXd& also, const PieceScatter& scatter) {
  ConstantsDifference result;
  const Eigen::MatrixXd both = a.covariance + b.covariance;
  const Eigen::MatrixXd measured = measured_combinations(both);
  if (measured.cols() == 0) return result;
  const algebra::SymmetricSolver solver(measured.transpose() *
                                        (scatter.variance_factor * both + also) * measured);
  const Eigen::VectorXd off = measured.transpose() * (b.mean - a.mean);
  const Eigen::VectorXd weighted = solver.solve(off);
  result.chi2 = off.dot(weighted);
  result.combinations = static_cast<int>(measured.cols());
  result.joint_p_value = tail(result.chi2, result.combinations, scatter);
  // On constant i alone, the measured combinations give u = row i of them: off = change u + noise.
  result.change = result.change_sigma =
      Eigen::VectorXd::Constant(measured.rows(), std::numeric_limits<double>::quiet_NaN());
  double best = 0;
  int tried = 0;
  for (Index i = 0; i < measured.rows(); ++i) {
    const Eigen::VectorXd u = measured.row(i);
    if (u.norm() < kLeastMeasured) continue;
    ++tried;
    const double information = u.dot(solver.solve(u)), vector = u.dot(weighted);
    result.change[i] = vector / information;
    result.change_sigma[i] = 1 / std::sqrt(information);
    const double chi2 = vector * vector / information;
    if (chi2 < best) continue;
    best = chi2;
    result.constant = i;
  }
  result.single_p_value = std::min(1.0, tried * tail(best, 1, scatter));
  result.p_value = std::min(1.0, 2 * std::min(result.joint_p_value, result.single_p_value));
  return result;
}

}  // namespace risley::estimation
