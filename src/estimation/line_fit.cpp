// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation/line_fit.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"

namespace risley::estimation {
namespace {

Complex transverse(const AngleSeries& series, std::size_t i) {
  const auto v = direction_from_angles<double>({series.azimuth[i], series.zenith[i]});
  return {v.y, v.z};
}

}  // namespace

TransverseShots hann_shots(const AngleSeries& series, ShotRange rows, std::int64_t reference_ns,
                           std::size_t most) {
  TransverseShots shots;
  const double span =
      1e-9 * static_cast<double>(series.time_ns[rows.end - 1] - series.time_ns[rows.begin]);
  const std::size_t stride = std::max<std::size_t>(1, rows.size() / most);
  for (std::size_t i = rows.begin; i < rows.end; i += stride) {
    const double t = 1e-9 * static_cast<double>(series.time_ns[i] - reference_ns);
    shots.time.push_back(t);
    const double u =
        1e-9 * static_cast<double>(series.time_ns[i] - series.time_ns[rows.begin]) / span;
    shots.weight.push_back(0.5 - 0.5 * std::cos(kTwoPi * u) + 1e-3);
    shots.value.push_back(transverse(series, i));
  }
  return shots;
}

LineFit fit_lines(const TransverseShots& shots, std::span<const double> speeds) {
  const auto size = static_cast<Eigen::Index>(speeds.size() + 1);
  Eigen::MatrixXcd normal = Eigen::MatrixXcd::Zero(size, size);
  Eigen::VectorXcd right = Eigen::VectorXcd::Zero(size), row(size);
  double total = 0;
  for (std::size_t i = 0; i < shots.time.size(); ++i) {
    row[0] = 1.0;
    for (Eigen::Index k = 1; k < size; ++k) {
      row[k] = std::polar(1.0, -speeds[static_cast<std::size_t>(k - 1)] * shots.time[i]);
    }
    const double weight = shots.weight[i];
    for (Eigen::Index k = 0; k < size; ++k) {
      right[k] += weight * row[k] * shots.value[i];
      for (Eigen::Index l = 0; l <= k; ++l) normal(k, l) += weight * row[k] * std::conj(row[l]);
    }
    total += weight * std::norm(shots.value[i]);
  }
  normal.diagonal().array() += 1e-9 * normal(0, 0);
  normal.triangularView<Eigen::StrictlyUpper>() = normal.adjoint();
  const Eigen::VectorXcd amplitude = normal.ldlt().solve(right);
  return {{amplitude.begin(), amplitude.end()}, total - amplitude.dot(right).real()};
}

}  // namespace risley::estimation
