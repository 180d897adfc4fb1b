// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/weak_directions.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/require.hpp"

namespace risley::estimation {

std::vector<WeakDirection> weak_directions(const Eigen::MatrixXd& information,
                                           const std::vector<FreeParameter>& free,
                                           double most_sigma) {
  require_length("rows of the information", static_cast<std::size_t>(information.rows()),
                 free.size());
  require_length("columns of the information", static_cast<std::size_t>(information.cols()),
                 free.size());
  require_above("most sigma", most_sigma, 0);
  for (const FreeParameter& parameter : free) {
    require_above("prior sigma of " + parameter.name, parameter.prior_sigma, 0);
  }
  const auto n = static_cast<Eigen::Index>(free.size());
  std::vector<WeakDirection> weak;
  if (n == 0) return weak;
  Eigen::VectorXd scale(n);
  for (Eigen::Index i = 0; i < n; ++i) scale[i] = free[static_cast<std::size_t>(i)].prior_sigma;
  const algebra::PrincipalAxes axes = algebra::principal_axes(algebra::scaled(information, scale));
  const double largest = axes.values[n - 1];
  for (Eigen::Index i = 0; i < n; ++i) {  // weakest first
    // Below this, eigenvalues are rounding of the largest.
    const double value = std::max(axes.values[i], 1e-15 * largest);
    const double sigma = 1.0 / std::sqrt(value);
    if (!(sigma > most_sigma)) break;
    WeakDirection direction;
    direction.sigma = sigma;
    direction.ratio = std::sqrt(value / largest);
    Eigen::VectorXd weight = axes.vectors.col(i);
    Eigen::Index strongest = 0;
    weight.cwiseAbs().maxCoeff(&strongest);
    if (weight[strongest] < 0) weight = -weight;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (std::abs(weight[j]) >= 0.05) {
        direction.weights.emplace_back(free[static_cast<std::size_t>(j)].name, weight[j]);
      }
    }
    std::sort(direction.weights.begin(), direction.weights.end(),
              [](const auto& a, const auto& b) { return std::abs(a.second) > std::abs(b.second); });
    weak.push_back(std::move(direction));
  }
  return weak;
}

std::string direction_text(const WeakDirection& direction) {
  std::string text;
  for (const auto& [name, weight] : direction.weights) {
    text += text.empty() ? "" : weight < 0 ? " - " : " + ";
    text += fmt::format("{:.2f} {}", std::abs(weight), name);
  }
  return text;
}

}  // namespace risley::estimation
