// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/interpolation.hpp"

#include <algorithm>
#include <cmath>

#include "risley/algebra/rotation_vector.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"

namespace risley::trajectories {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// Records further apart than this part of the median step may both be used.
constexpr std::int64_t kCloseParts = 4;
/// Number of records examined on each side of an interval.
constexpr std::size_t kFarthestRecord = 64;

/// A rotation vector of the same rotation, the nearest one to another vector.
Eigen::Vector3d nearest_turn(const Eigen::Vector3d& vector, const Eigen::Vector3d& to) {
  const double angle = vector.norm();
  if (angle == 0.0) return vector;
  const Eigen::Vector3d axis = vector / angle;
  const double turns = std::round((axis.dot(to) - angle) / kTwoPi);
  return vector + turns * kTwoPi * axis;
}

}  // namespace

Interpolation::Interpolation(const Trajectory& trajectory, const InterpolationOptions& options)
    : trajectory_(&trajectory) {
  require_trajectory(trajectory);
  require_above("gap_steps", options.gap_steps, 1.0);
  const std::vector<std::int64_t>& times = trajectory.time_ns;
  if (times.size() < 2) return;
  std::vector<std::int64_t> steps(times.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = times[i + 1] - times[i];
  median_step_ns_ = upper_median(steps);
  constexpr double kMost_ns = 0x1p62;
  longest_step_ns_ = static_cast<std::int64_t>(
      std::min(options.gap_steps * static_cast<double>(median_step_ns_), kMost_ns));
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    if (is_gap(i)) gaps_.push_back({i, times[i], times[i + 1]});
  }
}

/// Whether there is a gap between a record and the next one.
bool Interpolation::is_gap(std::size_t row) const {
  return trajectory_->time_ns[row + 1] - trajectory_->time_ns[row] > longest_step_ns_;
}

/// Finds the polynomials between a record and the next one.
void Interpolation::Cursor::set_interval(std::size_t row) {
  const Trajectory& all = *interpolation_->trajectory_;
  row_ = row;
  begin_ns_ = all.time_ns[row];
  end_ns_ = all.time_ns[row + 1];
  has_pose_ = !interpolation_->is_gap(row);
  if (!has_pose_) return;
  interval_ = 1e-9 * static_cast<double>(end_ns_ - begin_ns_);

  // Records of either side, nearest first.
  std::array<std::size_t, kPoints> before{}, after{};
  std::size_t befores = 1, afters = 1;
  before[0] = row;
  after[0] = row + 1;
  const std::int64_t close_ns = interpolation_->median_step_ns_ / kCloseParts;
  for (std::size_t i = row; i > 0 && row - i < kFarthestRecord && befores < kPoints - 1; --i) {
    if (interpolation_->is_gap(i - 1)) break;
    if (all.time_ns[before[befores - 1]] - all.time_ns[i - 1] >= close_ns) {
      before[befores++] = i - 1;
    }
  }
  for (std::size_t i = row + 1;
       i + 1 < all.size() && i - row <= kFarthestRecord && afters < kPoints - 1; ++i) {
    if (interpolation_->is_gap(i)) break;
    if (all.time_ns[i + 1] - all.time_ns[after[afters - 1]] >= close_ns) after[afters++] = i + 1;
  }
  constexpr std::size_t kHalf = kPoints / 2;
  const std::size_t most_before = afters < kHalf ? kPoints - afters : kHalf;
  const std::size_t most_after = befores < kHalf ? kPoints - befores : kHalf;
  befores = std::min(befores, most_before);
  afters = std::min(afters, most_after);

  // Newton's divided differences, in intervals of time.
  std::array<double, kPoints> at{};
  std::array<Vector6, kPoints> values;
  std::size_t points = 0;
  const auto add = [&](std::size_t record, const Eigen::Vector3d& neighbour) -> Eigen::Vector3d {
    Eigen::Vector3d turn = nearest_turn(
        algebra::rotation_vector(all.attitude[row].conjugate() * all.attitude[record]), neighbour);
    at[points] = 1e-9 * static_cast<double>(all.time_ns[record] - begin_ns_) / interval_;
    values[points++] << all.position[record] - all.position[row], turn;
    return turn;
  };
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < befores; ++i) turn = add(before[i], turn);
  turn.setZero();
  for (std::size_t i = 0; i < afters; ++i) turn = add(after[i], turn);
  for (std::size_t order = 1; order < points; ++order) {
    for (std::size_t i = points - 1; i >= order; --i) {
      values[i] = (values[i] - values[i - 1]) / (at[i] - at[i - order]);
    }
  }
  // The same polynomial in powers.
  coefficients_.fill(Vector6::Zero());
  for (std::size_t i = points; i-- > 0;) {
    for (std::size_t power = kPoints - 1; power > 0; --power) {
      coefficients_[power] = coefficients_[power - 1] - at[i] * coefficients_[power];
    }
    coefficients_[0] = values[i] - at[i] * coefficients_[0];
  }
}

std::optional<Pose> Interpolation::Cursor::at(std::int64_t time_ns) {
  const Trajectory& all = *interpolation_->trajectory_;
  const std::vector<std::int64_t>& times = all.time_ns;
  if (times.size() < 2 || time_ns < times.front() || time_ns > times.back()) return std::nullopt;
  if (time_ns < begin_ns_ || time_ns >= end_ns_) {
    const bool is_next = time_ns >= end_ns_ && row_ + 2 < times.size() && begin_ns_ < end_ns_ &&
                         time_ns < times[row_ + 2];
    std::size_t row = row_ + 1;
    if (!is_next) {
      const auto later = std::ranges::upper_bound(times, time_ns);
      row = static_cast<std::size_t>(later - times.begin()) - 1;
    }
    row = std::min(row, times.size() - 2);
    // A record at the beginning of a gap is the end of the stretch before it.
    if (row > 0 && time_ns == times[row] && interpolation_->is_gap(row)) --row;
    if (row != row_ || begin_ns_ > end_ns_) set_interval(row);
  }
  if (!has_pose_) return std::nullopt;
  const double u = 1e-9 * static_cast<double>(time_ns - begin_ns_) / interval_;
  Vector6 value = coefficients_[kPoints - 1], slope = Vector6::Zero();
  for (std::size_t power = kPoints - 1; power-- > 0;) {
    slope = u * slope + value;
    value = u * value + coefficients_[power];
  }
  slope /= interval_;
  const Eigen::Vector3d turn = value.tail<3>();
  Pose pose;
  pose.position = all.position[row_] + value.head<3>();
  pose.attitude = all.attitude[row_] * algebra::turned_by(turn);
  pose.attitude.normalize();
  pose.velocity = slope.head<3>();
  pose.angular_velocity = pose.attitude * algebra::angular_velocity_of(turn, slope.tail<3>());
  return pose;
}

}  // namespace risley::trajectories
