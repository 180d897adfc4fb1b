// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "risley/trajectories/trajectory.hpp"

namespace risley::trajectories {

/// Pose and motion of a platform at a time.
struct Pose {
  Eigen::Vector3d position{0, 0, 0};                             ///< in the trajectory's frame, m
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();  ///< frame from body
  Eigen::Vector3d velocity{0, 0, 0};                             ///< along the frame's axes, m/s
  Eigen::Vector3d angular_velocity{0, 0, 0};  ///< of the body, along the frame's axes, rad/s
};

/// Time without records.
struct TrajectoryGap {
  std::size_t row = 0;                    ///< last record before it
  std::int64_t begin_ns = 0, end_ns = 0;  ///< times of the records around it
};

/// Where a trajectory is not interpolated.
struct InterpolationOptions {
  /// A step longer than this many median steps is a gap, which has no poses, > 1. The default
  /// allows two consecutive missing records.
  double gap_steps = 3.5;
};

/// Poses between the records of a trajectory: polynomials of the fifth degree through the three
/// records before and the three after a time, for the position and for the rotation vector from the
/// record before. Next to a gap and at the ends six records of this side are used, or all if there
/// are fewer. There is no pose before the first record, after the last one and within a gap, and a
/// single record between two gaps has none. Of records closer together than a quarter of the median
/// step only those around the time itself are used. Error of a sinusoid of amplitude A and angular
/// frequency w at a step h, between records on both sides: 0.0049 A (w h)^6.
/// docs/theory/trajectories.md
class Interpolation {
 public:
  static constexpr std::size_t kPoints = 6;  ///< records that a polynomial goes through

  /// @param trajectory  must outlive this
  /// @throws InvalidArgument as require_trajectory, and for gap_steps not above 1
  explicit Interpolation(const Trajectory& trajectory, const InterpolationOptions& options = {});

  /// Looks up poses in sequence; each thread has its own, and times close to the previous one are
  /// cheap. Any order is allowed.
  class Cursor {
   public:
    /// @param interpolation  must outlive this
    explicit Cursor(const Interpolation& interpolation) : interpolation_(&interpolation) {}
    /// The pose, or nothing without one. @param time_ns in the trajectory's time
    std::optional<Pose> at(std::int64_t time_ns);

   private:
    void set_interval(std::size_t row);

    const Interpolation* interpolation_;
    // The interval between two records and the polynomials in it; without one, begin > end.
    std::int64_t begin_ns_ = std::numeric_limits<std::int64_t>::max();
    std::int64_t end_ns_ = std::numeric_limits<std::int64_t>::min();
    bool has_pose_ = false;
    std::size_t row_ = 0;
    double interval_ = 0;  // s
    /// Coefficients of the powers of (t - begin) / interval: position and rotation vector [6].
    std::array<Eigen::Matrix<double, 6, 1>, kPoints> coefficients_;
  };

  /// A separate cursor for every thread that needs poses. @note This must outlive it.
  Cursor cursor() const { return Cursor(*this); }
  /// As Cursor::at, for single times.
  std::optional<Pose> at(std::int64_t time_ns) const { return cursor().at(time_ns); }

  /// The records between which it interpolates.
  const Trajectory& trajectory() const { return *trajectory_; }
  /// The gaps between records, which have no poses.
  const std::vector<TrajectoryGap>& gaps() const { return gaps_; }
  std::int64_t median_step_ns() const { return median_step_ns_; }  ///< 0 for a single record

 private:
  bool is_gap(std::size_t row) const;

  const Trajectory* trajectory_;
  std::int64_t longest_step_ns_ = 0;  ///< that is no gap
  std::int64_t median_step_ns_ = 0;
  std::vector<TrajectoryGap> gaps_;
};

}  // namespace risley::trajectories
