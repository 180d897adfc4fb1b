// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/shot_pose.hpp"
#include "risley/trajectories/interpolation.hpp"

namespace risley::calibration {

/// Shots of a flight with a range, as columns of one length, in the order of their times.
struct FlightShots {
  std::vector<std::vector<double>> rotation_angle;  ///< [prisms][shots], rad, within half a turn
  std::vector<std::uint8_t> beam;                   ///< emitter, from 0; empty: all the first
  std::vector<double> range;                        ///< m, as measured
  std::vector<std::int64_t> time_ns;                ///< of the recording's clock, ascending
  std::vector<std::uint16_t> strip;                 ///< number of the strip, from 0, ascending

  std::size_t size() const { return range.size(); }
  /// Number of columns of rotation angles.
  int prisms() const { return static_cast<int>(rotation_angle.size()); }
  /// Number of strips: one more than the last shot's.
  std::size_t strips() const { return strip.empty() ? 0 : std::size_t{1} + strip.back(); }
};

/// @throws InvalidArgument for no shot, columns of different lengths, non-finite numbers, ranges
/// not above 0, times or strips that descend; the message names column and row
void require_flight_shots(const FlightShots& shots);

/// Some shots by their rows, which must ascend. @throws InvalidArgument for a row that does not
/// exist
FlightShots rows_of(const FlightShots& shots, const std::vector<std::size_t>& rows);

/// Poses of shots at the trajectory's time, recording's clock + clock_offset.
struct ShotPoses {
  double clock_offset = 0;  ///< s
  std::vector<ShotPose> pose;
};

/// Rows of the shots that have a pose at every clock offset within the margin.
/// @param margin  s, 0 or more
std::vector<std::size_t> rows_with_pose(const FlightShots& shots,
                                        const trajectories::Interpolation& local,
                                        double clock_offset, double margin);

/// @param local  of a trajectory in a local frame
/// @throws InvalidArgument for a trajectory that is not local, a clock offset that is not finite or
/// beyond a day, and a shot without pose, naming its row
ShotPoses poses_of(const FlightShots& shots, const trajectories::Interpolation& local,
                   double clock_offset);

}  // namespace risley::calibration
