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

/// One record of a file, in SI units. Angles, places and positions in the form for the trajectory's
/// frame.
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

/// Contents of a file's records.
struct RowContents {
  std::string format;
  TimeScale time_scale = TimeScale::unknown;
  std::optional<int> gps_week;
  Frame frame = Frame::geocentric;
  bool has_velocity = false, has_wander = false, has_accuracy = false;
  std::optional<VelocityAxes> velocity_axes;  ///< where the file states them
};

/// Makes a trajectory from records: common requirements of all formats, and their ordering.
class PoseRows {
 public:
  PoseRows(std::string path, RowContents contents);

  /// Adds a record. @param place  of the record, for messages; none: its number
  /// @throws FileError for physically impossible values
  void add(const PoseRow& row, const FilePlace& place);

  std::vector<Warning>& warnings() { return trajectory_.warnings; }
  std::size_t size() const { return trajectory_.size(); }

  /// Continues times beyond the end of the week or day; sorts records by time; converts velocities
  /// to the frame.
  /// @throws FileError without any record, and if times run back by more than a second
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

/// Warnings about records that were sorted.
/// @param place_of  of a record, by its number from 0
std::vector<Warning> order_warnings(const TimeOrder& found, std::size_t records,
                                    const std::function<FilePlace(std::size_t)>& place_of);

/// Period of a scale of time, s; nothing if it does not repeat.
std::optional<std::int64_t> period_ns(TimeScale scale);

/// Times that restart after a period made continuous: each is as near as possible to the one
/// before.
/// @return how often they began again
int unwrap_times(std::vector<std::int64_t>& times_ns, std::int64_t period_ns);

/// Origin of times by their size: UTC since 1970 if they are of the years 1998 to 2100, a clock
/// unless stated otherwise.
TimeScale scale_by_size(const std::vector<std::int64_t>& ascending_ns);

/// Half a turn of the body about its x axis: forward-left-up axes, as in ROS, to forward-right-down
/// and back. Exact.
Eigen::Quaterniond right_down_from_left_up(const Eigen::Quaterniond& frame_from_left_up);
Eigen::Quaterniond left_up_from_right_down(const Eigen::Quaterniond& frame_from_right_down);

/// A file's quaternion normalised to unit length; those that already are keep their bits.
/// @return nothing if its length is not within a hundredth of 1
std::optional<Eigen::Quaterniond> unit_quaternion(const Eigen::Quaterniond& q);

}  // namespace risley::trajectories
