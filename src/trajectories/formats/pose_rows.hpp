// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/trajectories/geodesy.hpp"
#include "risley/trajectories/trajectory.hpp"

#include "trajectories/velocity_frame.hpp"

namespace risley::trajectories {

/// One record of a file, in SI units. Angles, places and positions as the trajectory's frame needs
/// them.
struct PoseRow {
  std::int64_t time_ns = 0;  ///< as the file counts
  Geodetic place;
  RollPitchHeading angles;  ///< the heading is the true one
  Eigen::Vector3d position{0, 0, 0};
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();  ///< frame from body
  Eigen::Vector3d velocity{0, 0, 0};                             ///< along the file's axes
  double wander = 0;
  PoseAccuracy accuracy;
};

/// What the records of a file hold.
struct RowContents {
  std::string format;
  TimeScale time_scale = TimeScale::unknown;
  std::optional<int> gps_week;
  Frame frame = Frame::geocentric;
  bool has_velocity = false, has_wander = false, has_accuracy = false;
  std::optional<VelocityAxes> velocity_axes;  ///< where the file states them
};

/// Makes a trajectory of records: what every format's records must be, and how they are ordered.
class PoseRows {
 public:
  PoseRows(std::string path, RowContents contents);

  /// Adds a record. @param place  of the record, for messages; none: its number
  /// @throws FileError for values that no platform has
  void add(const PoseRow& row, const FilePlace& place);

  std::vector<Warning>& warnings() { return trajectory_.warnings; }
  std::size_t size() const { return trajectory_.size(); }

  /// Times that ran on beyond the end of the week or day; records in the order of their times;
  /// velocities in the frame.
  /// @throws FileError without any record, and where times run back by more than a second
  Trajectory finish();

 private:
  void make_times_run_on();
  void put_in_order();
  [[noreturn]] void refuse(std::size_t row, const FilePlace& place,
                           const std::string& problem) const;

  std::string path_;
  RowContents contents_;
  Trajectory trajectory_;
  std::vector<double> wander_;
  std::vector<FilePlace> places_;  ///< of the rows
};

/// Warnings about records that were put in order.
/// @param place_of  of a record, by its number from 0
std::vector<Warning> order_warnings(const TimeOrder& told, std::size_t records,
                                    const std::function<FilePlace(std::size_t)>& place_of);

/// Seconds after which a scale of time begins again; nothing where it never does.
std::optional<std::int64_t> period_ns(TimeScale scale);

/// Times that begin again after a period made to run on: each is as near as can be to the one
/// before.
/// @return how often they began again
int unwrap_times(std::vector<std::int64_t>& times_ns, std::int64_t period_ns);

/// What times count from by their size: UTC since 1970 where they are of the years 1998 to 2100, a
/// clock unless stated otherwise.
TimeScale scale_by_size(const std::vector<std::int64_t>& ascending_ns);

/// Half the body's turn about its x axis: forward-left-up axes, as ROS has them, to
/// forward-right-down and back. Exact.
Eigen::Quaterniond right_down_from_left_up(const Eigen::Quaterniond& frame_from_left_up);
Eigen::Quaterniond left_up_from_right_down(const Eigen::Quaterniond& frame_from_right_down);

/// A quaternion of a file made a unit quaternion; those that are already keep their bits.
/// @return nothing where its length is not within a hundredth of 1
std::optional<Eigen::Quaterniond> unit_quaternion(const Eigen::Quaterniond& q);

}  // namespace risley::trajectories
