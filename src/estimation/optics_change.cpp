// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation/optics_change.hpp"

#include <algorithm>

#include <unsupported/Eigen/SpecialFunctions>

#include "risley/algebra/symmetric.hpp"

namespace risley::estimation {
namespace {

using Eigen::Index;

/// A combination that keeps more of its prior variance than this was not measured.
constexpr double kMostPriorVariance = 0.3 * 0.3;

/// Orthonormal columns: the combinations that a covariance says were measured.
Eigen::MatrixXd measured_combinations(const Eigen::MatrixXd& covariance) {
  const algebra::PrincipalAxes axes = algebra::principal_axes(covariance);
  const auto count = std::count_if(axes.values.begin(), axes.values.end(),
                                   [](double v) { return v < kMostPriorVariance; });
  return axes.vectors.leftCols(count);
}

/// Probability that F's distribution exceeds a value.
double f_tail(double value, double numerator, double denominator) {
  return Eigen::numext::betainc(0.5 * denominator, 0.5 * numerator,
                                denominator / (denominator + numerator * value));
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
  const Eigen::MatrixXd covariance =
      measured.transpose() * (scatter.variance_factor * both + also) * measured;
  result.chi2 = algebra::SymmetricSolver(covariance).chi2(measured.transpose() * (b.mean - a.mean));
  result.combinations = static_cast<int>(measured.cols());
  const double m = result.combinations;
  result.p_value = scatter.variance_factor > 1 && scatter.degrees_of_freedom > 0
                       ? f_tail(result.chi2 / m, m, scatter.degrees_of_freedom)
                       : Eigen::numext::igammac(0.5 * m, 0.5 * result.chi2);
  return result;
}

}  // namespace risley::estimation
