// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/trajectories/interpolation.hpp"
#include "risley/trajectories/trajectory.hpp"
#include "risley/trajectories/trajectory_file.hpp"

namespace risley::trajectories {

/// Smallest and largest value.
struct Extent {
  double min = 0, max = 0;
};

/// Times of records of any kind.
struct RecordTimes {
  std::size_t records = 0;
  std::int64_t first_ns = 0, last_ns = 0;
  double duration_s = 0;
  double rate_hz = 0;  ///< 1 / median step; 0 for a single record
  std::vector<TrajectoryGap> gaps;
  double gaps_total_s = 0;  ///< missing time: the steps without the median step
};

/// Contents of a trajectory and their quality.
struct TrajectoryAudit {
  RecordTimes times;
  std::optional<Extent> latitude, longitude;  ///< geocentric frames, rad
  Extent height;                              ///< above the ellipsoid, or z of a local frame, m
  Extent roll, pitch;                         ///< rad
  double fastest = 0;          ///< largest speed between records without a gap between them, m/s
  double fastest_turning = 0;  ///< largest angular rate between them, rad/s
  std::optional<PoseAccuracy> accuracy;  ///< median of each accuracy
  std::vector<Warning> warnings;         ///< of reading, and from this audit
};

/// @throws InvalidArgument as require_trajectory and for gap_steps as Interpolation; Cancelled
TrajectoryAudit audit_trajectory(const Trajectory& trajectory,
                                 const InterpolationOptions& options = {},
                                 const Progress& progress = {});

/// What a file of accuracies holds.
struct AccuracyAudit {
  RecordTimes times;
  PoseAccuracy median, worst;
};

/// @throws InvalidArgument for no record, columns of different lengths or times that do not ascend
AccuracyAudit audit_accuracies(const AccuracyRecords& accuracies);

/// An angle in words: "0.017 degree (1.0 arc-minute)". @throws InvalidArgument when it is not
/// finite
std::string angle_words(double angle);

}  // namespace risley::trajectories
