// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "cloud/sensor_path.hpp"

#include <algorithm>
#include <optional>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "cloud/georeference_kernel.hpp"

namespace risley::cloud {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Duration over which a polynomial replaces the interpolation: for a rotation of 10 rad/s the
/// error is (0.05)^6 / 6!.
constexpr std::int64_t kCell_ns = 5'000'000;
constexpr int kDegree = static_cast<int>(kPathPowers) - 1;

}  // namespace

/// A stretch of some milliseconds without a record inside, where polynomials of time repeat the
/// interpolation.
class SensorPath::Cell {
 public:
  explicit Cell(const SensorPath& path) : path_(path), cursor_(path.interpolation_.cursor()) {}

  /// Becomes the cell of a time. @return whether the trajectory has a pose there
  bool set(std::int64_t time_ns);
  bool contains(std::int64_t time_ns) const { return time_ns >= begin_ns_ && time_ns <= end_ns_; }
  /// Since the beginning, as a share of a whole cell.
  double part(std::int64_t time_ns) const {
    return static_cast<double>(time_ns - begin_ns_) / static_cast<double>(kCell_ns);
  }
  /// Fills rows [first, first + count) of poses. @param parts  of their times
  void fill(const double* parts, std::size_t count, SensorPoses& poses, std::size_t first,
            InstructionSet set) const;

 private:
  const SensorPath& path_;
  trajectories::Interpolation::Cursor cursor_;
  std::int64_t begin_ns_ = 1, end_ns_ = 0;  // both included
  /// Of each power of time: reference point less its initial position, and rotation.
  Eigen::Matrix<double, kPathNumbers, kPathPowers> coefficients_;
  Vector3d origin_, velocity_, rate_;
  std::uint16_t strip_ = 0;
};

bool SensorPath::Cell::set(std::int64_t time_ns) {
  const std::vector<std::int64_t>& times = path_.trajectory_.time_ns;
  if (times.size() < 2 || time_ns < times.front() || time_ns > times.back()) return false;
  const auto later = std::upper_bound(times.begin(), times.end() - 1, time_ns);
  const std::int64_t first = *std::prev(later), last = *later;
  const std::int64_t cells = (last - first + kCell_ns - 1) / kCell_ns;
  const std::int64_t cell = std::min(cells - 1, (time_ns - first) / kCell_ns);
  begin_ns_ = first + cell * kCell_ns;
  end_ns_ = std::min(last, begin_ns_ + kCell_ns);
  Eigen::Matrix<double, kPathNumbers, kPathPowers> values;
  Eigen::Matrix<double, kPathPowers, kPathPowers> powers;
  for (int node = 0; node <= kDegree; ++node) {
    const std::int64_t at = begin_ns_ + (end_ns_ - begin_ns_) * node / kDegree;
    const std::optional<trajectories::Pose> pose = cursor_.at(at);
    if (!pose) return false;  // a gap, or a record between two
    const Matrix3d turn = pose->attitude.toRotationMatrix() * path_.body_from_sensor_;
    if (node == 0) {
      origin_ = pose->position;
      rate_ = turn.transpose() * pose->angular_velocity;
      velocity_ = turn.transpose() * pose->velocity + rate_.cross(path_.lever_arm_);
    }
    values.col(node) << pose->position - origin_,
        Eigen::Map<const Eigen::Matrix<double, 9, 1>>(turn.data());
    double power = 1;
    for (int k = 0; k <= kDegree; ++k) {
      powers(k, node) = power;
      power *= part(at);
    }
  }
  coefficients_ = values * powers.inverse();
  const std::vector<trajectories::FlownStrip>& strips = path_.strips_;
  const auto behind =
      std::ranges::upper_bound(strips, begin_ns_, {}, &trajectories::FlownStrip::begin_ns);
  strip_ = 0;
  if (behind != strips.begin() && begin_ns_ <= std::prev(behind)->end_ns) {
    strip_ = static_cast<std::uint16_t>(behind - strips.begin());
  }
  return true;
}

void SensorPath::Cell::fill(const double* parts, std::size_t count, SensorPoses& poses,
                            std::size_t first, InstructionSet set) const {
  PathArguments a;
  a.shots = count;
  a.part = parts;
  a.coefficients = coefficients_.data();
  for (std::size_t k = 0; k < 3; ++k) {
    a.origin[k] = origin_[k];
    a.reference[k] = poses.reference[k].data() + first;
    std::fill_n(poses.velocity[k].data() + first, count, velocity_[k]);
    std::fill_n(poses.rate[k].data() + first, count, rate_[k]);
  }
  for (std::size_t k = 0; k < 9; ++k) a.turn[k] = poses.turn[k].data() + first;
  std::fill_n(poses.strip.data() + first, count, strip_);
  RISLEY_KERNEL_COPIES(follow_path).at(set)(a);
}

SensorPath::SensorPath(const trajectories::Trajectory& trajectory,
                       const trajectories::Interpolation& interpolation,
                       const trajectories::Mount& mount)
    : trajectory_(trajectory),
      interpolation_(interpolation),
      strips_(trajectories::flown_strips(interpolation)),
      body_from_sensor_(trajectories::body_from_sensor(mount)),
      lever_arm_(body_from_sensor_.transpose() * trajectories::lever_arm(mount)) {}

void SensorPath::find(std::span<const std::int64_t> times_ns, SensorPoses& poses,
                      std::vector<std::size_t>& rows, InstructionSet set) const {
  poses.resize(times_ns.size());
  poses.lever_arm = lever_arm_;
  rows.clear();
  Cell cell(*this);
  std::vector<double> parts(times_ns.size());
  for (std::size_t i = 0; i < times_ns.size();) {
    if (!cell.set(times_ns[i])) {
      ++i;
      continue;
    }
    const std::size_t first = rows.size();
    for (; i < times_ns.size() && cell.contains(times_ns[i]); ++i) {
      parts[rows.size()] = cell.part(times_ns[i]);
      rows.push_back(i);
    }
    cell.fill(parts.data() + first, rows.size() - first, poses, first, set);
  }
  poses.resize(rows.size());
}

}  // namespace risley::cloud
