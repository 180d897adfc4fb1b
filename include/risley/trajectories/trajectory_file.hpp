// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/trajectories/trajectory.hpp"

namespace risley::trajectories {

/// What a file holds of a flight.
enum class TrajectoryFileKind { none, trajectory, accuracies };

/// Whether a file is a trajectory or a file of accuracies: recognised by content, or by the ending
/// where the content is ambiguous (.sbet, .smrmsg). Unreadable files are not, and neither is a bag
/// with points of a lidar: it is a recording, though load_trajectory() reads its poses.
/// @throws Cancelled: a truncated bag may have to be scanned for its topics
TrajectoryFileKind trajectory_file_kind(const std::string& path, const Progress& progress = {});

/// Reads a trajectory of any known format: SBET, Inertial Explorer and POSPac text, CSV with named
/// columns, TUM, poses in bags of ROS and folders of them. docs/files.md lists the contents of
/// each.
/// @param topic  of a bag that holds several topics of poses; otherwise it may be empty
/// @throws FileError when it is missing, empty, of no known format or damaged, and if times run
/// back or a record is physically impossible; InvalidArgument for a topic that is missing or holds
/// no poses, and for a topic of a file that is not a bag; Cancelled
Trajectory load_trajectory(const std::string& path, const Progress& progress = {},
                           const std::string& topic = {});

/// An output format, and the file name ending that selects it.
struct WritableTrajectory {
  std::string name;    ///< as Trajectory::format
  std::string ending;  ///< ".csv"
  std::string description;
};

/// All formats that can be written.
const std::vector<WritableTrajectory>& writable_trajectories();

/// Writes a trajectory. The file appears under its name when it is complete.
/// @param format  name of an output format; empty uses the file name's ending
/// @return data that the format cannot hold and that were dropped, in words; empty for nothing
/// @throws InvalidArgument as require_trajectory, for an unknown ending or format, and for
/// trajectories that the format cannot hold at all; FileError
std::vector<std::string> write_trajectory(const std::string& path, const Trajectory& trajectory,
                                          const std::string& format = {});

/// The text of a trajectory as CSV, as write_trajectory() writes it to a file.
/// @throws InvalidArgument as require_trajectory
std::string trajectory_csv(const Trajectory& trajectory);

/// Accuracies with their own times, ordered by time.
struct AccuracyRecords {
  TimeScale time_scale = TimeScale::gps_second_of_week;
  std::vector<std::int64_t> time_ns;
  std::vector<PoseAccuracy> accuracy;
  std::vector<Eigen::Vector3d> velocity;  ///< standard deviations north, east, down, m/s
  std::vector<Warning> warnings;
};

/// Reads SMRMSG, the accuracies that belong to an SBET: records of 80 bytes.
/// @throws FileError as load_trajectory
AccuracyRecords load_accuracies(const std::string& path, const Progress& progress = {});

/// Gives every record of a trajectory the accuracy at its time: interpolated linearly, and that of
/// the nearest record up to two median steps beyond the ends.
/// @param path  of the accuracies, for messages
/// @throws InvalidArgument for columns of different lengths or none; FileError if both have
/// different scales of time or the accuracies do not cover the trajectory
void add_accuracies(Trajectory& trajectory, const AccuracyRecords& accuracies,
                    const std::string& path);

}  // namespace risley::trajectories
