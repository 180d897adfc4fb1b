// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/point_covariance.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

namespace risley::cloud {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Lever = Eigen::Matrix<double, 3, 6>;

/// Effect of the six errors of the trajectory on one point, each times its sigma, and without.
struct MovedPoint {
  std::int64_t time_ns = 0, sample = 0;
  Lever faded, white;
};

MovedPoint moved_point(const Points& points, const TrajectoryErrors& errors, std::size_t row) {
  MovedPoint result;
  result.time_ns = points.time_ns[row];
  const auto& times = errors.time_ns;
  if (result.time_ns < times.front() || result.time_ns > times.back()) {
    throw InvalidArgument(fmt::format(
        "time_ns of point {} = {}, allowed {} to {}, the times of the trajectory's poses", row,
        result.time_ns, times.front(), times.back()));
  }
  const auto later = std::ranges::upper_bound(times, result.time_ns);
  const auto after = std::min(static_cast<std::size_t>(later - times.begin()), times.size() - 1);
  const std::size_t before = after == 0 ? 0 : after - 1;
  const double span = static_cast<double>(times[after] - times[before]);
  const double part = span > 0 ? static_cast<double>(result.time_ns - times[before]) / span : 0.0;
  const auto between = [part](double a, double b) { return a + part * (b - a); };
  Vector3d arm(points.x[row], points.y[row], points.z[row]);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    arm[axis] -= between(errors.position[before][axis], errors.position[after][axis]);
  }
  for (std::size_t k = 0; k < 6; ++k) {
    const auto& of = errors.axes_from_ned[k % 3];
    Vector3d axis(of[0], of[1], of[2]);
    if (k == 2) axis = -axis;  // up
    const Vector3d moved = k < 3 ? axis : Vector3d(axis.cross(arm));
    result.faded.col(k) = between(errors.sigma[before][k], errors.sigma[after][k]) * moved;
    result.white.col(k) = errors.white[k] * moved;
  }
  if (errors.sample_interval > 0) {
    result.sample = static_cast<std::int64_t>(
        std::floor(1e-9 * static_cast<double>(result.time_ns - errors.first_sample_ns) /
                   errors.sample_interval));
  }
  return result;
}

}  // namespace

Matrix3d own_covariance(const Points& points, std::size_t row) {
  const auto& own = points.own_covariance;
  Matrix3d c;
  c << own[kXX][row], own[kXY][row], own[kXZ][row],  //
      own[kXY][row], own[kYY][row], own[kYZ][row],   //
      own[kXZ][row], own[kYZ][row], own[kZZ][row];
  return c;
}

Eigen::MatrixXd joint_covariance(const Points& points, const TrajectoryErrors& errors,
                                 std::span<const std::size_t> rows) {
  require_at_least("places of the trajectory", errors.time_ns.size(), 1);
  require_length("position", errors.position.size(), errors.time_ns.size());
  require_length("sigma", errors.sigma.size(), errors.time_ns.size());
  for (const auto& column : points.own_covariance) {
    require_length("own_covariance", column.size(), points.size());
  }
  for (const double time : errors.correlation_time) require_above("correlation_time", time, 0, "s");
  std::vector<MovedPoint> moved;
  for (const std::size_t row : rows) {
    require_place("row", row, points.size());
    moved.push_back(moved_point(points, errors, row));
  }
  const Index n = rows.size();
  Eigen::MatrixXd joint(3 * n, 3 * n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = i; j < n; ++j) {
      const double apart =
          1e-9 * std::abs(static_cast<double>(moved[i].time_ns - moved[j].time_ns));
      Eigen::Matrix<double, 6, 1> faded;
      for (std::size_t k = 0; k < 6; ++k) {
        faded[k] = std::exp(-apart / errors.correlation_time[k]);
      }
      Matrix3d block = moved[i].faded * faded.asDiagonal() * moved[j].faded.transpose();
      if (moved[i].sample == moved[j].sample) {
        block += moved[i].white * moved[j].white.transpose();
      }
      for (const auto& factor : points.loading) {
        const Vector3d f(factor[0][rows[i]], factor[1][rows[i]], factor[2][rows[i]]);
        const Vector3d g(factor[0][rows[j]], factor[1][rows[j]], factor[2][rows[j]]);
        block += f * g.transpose();
      }
      if (rows[i] == rows[j]) block += own_covariance(points, rows[i]);
      joint.block<3, 3>(3 * i, 3 * j) = block;
      joint.block<3, 3>(3 * j, 3 * i) = block.transpose();
    }
  }
  return joint;
}

}  // namespace risley::cloud
