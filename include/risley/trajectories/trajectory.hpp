// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "risley/core/error.hpp"
#include "risley/core/warning.hpp"

namespace risley::trajectories {

/// Origin of the times of a trajectory.
enum class TimeScale : std::uint8_t {
  unknown,             ///< the origin is not stated
  gps_second_of_week,  ///< GPS time since Sunday midnight; the week may be known
  utc_second_of_day,   ///< UTC since midnight
  gps,                 ///< GPS time since 6 January 1980
  adjusted_gps,        ///< the same less 1e9 s, as in LAS files
  utc_unix,            ///< UTC since 1 January 1970, without leap seconds
};

/// "gps-second-of-week"
std::string to_string(TimeScale scale);

/// "GPS second of week", for messages
std::string words_of(TimeScale scale);

/// Reference of positions and attitudes.
enum class Frame : std::uint8_t {
  geocentric,  ///< Earth-centred, Earth-fixed, WGS84-like ellipsoid (geodesy.hpp)
  local,       ///< axes of a local map: x east, y north if that is known, z up
};

/// "geocentric"
std::string to_string(Frame frame);

/// Attitude of a body (x forward, y right, z down) among axes north, east, down, rad:
/// Rz(heading) Ry(pitch) Rx(roll) turns the body's components of a vector into those. Heading is
/// clockwise from north, a positive pitch is nose up, a positive roll is right wing down.
struct RollPitchHeading {
  double roll = 0;     ///< [-pi, pi]
  double pitch = 0;    ///< [-pi/2, pi/2]
  double heading = 0;  ///< [0, 2 pi)
};

/// @throws InvalidArgument for non-finite angles
Eigen::Quaterniond ned_from_body(const RollPitchHeading& angles);

/// The inverse. If the nose points straight up or down only heading -+ roll is known: the roll is 0
/// there. @throws InvalidArgument for a quaternion that is not of length 1
RollPitchHeading roll_pitch_heading(const Eigen::Quaterniond& ned_from_body);

/// Standard deviations of one record, as stated by the program that made the trajectory.
struct PoseAccuracy {
  Eigen::Vector3d position{0, 0, 0};        ///< north, east, down, m
  double roll = 0, pitch = 0, heading = 0;  ///< rad
};

/// Axes of a file's velocities, found by comparing them with differences of its positions.
struct VelocityFrame {
  std::string name;    ///< "north-east-down"; "undecided" or "none" if the trajectory has none
  std::string reason;  ///< in words: the comparison made, or the reason why nothing was decided
  /// Velocity less differenced position, RMS along north, east, down, m/s; of the best frame if
  /// nothing is decided.
  std::optional<Eigen::Vector3d> residual;
};

/// The smallest, median and largest of angles, rad.
struct AngleSpread {
  double least = 0, median = 0, greatest = 0;
};

/// Changes needed to put rows into time order.
struct TimeOrder {
  std::size_t moved = 0;        ///< rows after a later one
  std::size_t repeated = 0;     ///< rows dropped because an earlier one had the same time
  std::size_t repeated_at = 0;  ///< the first of these, from 0
  /// Row, from 0, before which the largest step back was, and that step.
  std::size_t largest_back_at = 0;
  std::int64_t largest_back_ns = 0;
};

/// The poses of a moving platform as columns, one row per record, ordered by time. Velocities and
/// accuracies may be missing as a whole; all other columns have one length.
struct Trajectory {
  std::string format;  ///< short name, e.g. "sbet"; empty when it does not come from a file
  std::string source;  ///< within a file of several: topic and frames, in words
  TimeScale time_scale = TimeScale::unknown;
  std::optional<int> gps_week;  ///< of the first record's second of week, since 6 January 1980
  Frame frame = Frame::local;
  /// Seconds of week and of day run on beyond the end of theirs.
  std::vector<std::int64_t> time_ns;
  std::vector<Eigen::Vector3d> position;     ///< of the reference point, in the frame, m
  std::vector<Eigen::Quaterniond> attitude;  ///< frame from body (x forward, y right, z down)
  std::vector<Eigen::Vector3d> velocity;     ///< relative to the frame, along its axes, m/s
  std::vector<PoseAccuracy> accuracy;
  std::vector<Warning> warnings;  ///< of reading it
  /// Of a file that has one: angle from the platform's heading to the true one, which is less.
  std::optional<AngleSpread> wander;
  std::optional<VelocityFrame> velocity_frame;  ///< of a file's velocities
  int week_crossings = 0;                       ///< or midnights beyond which times were continued
  TimeOrder time_order;                         ///< of a file's records

  std::size_t size() const { return time_ns.size(); }
};

/// @throws InvalidArgument for no record, columns of different lengths, times that do not ascend or
/// are more than 146 years apart, and values that are not finite, attitudes that are not unit
/// quaternions, geocentric places as geodetic_from_geocentric; the message names column and row
void require_trajectory(const Trajectory& trajectory);

/// Unit vectors to the north, to the east and down at a place, the columns of a matrix [3, 3] in
/// the frame. In a local frame north is y and east is x.
/// @param position  in the frame, m
/// @throws InvalidArgument as geodetic_from_geocentric, in a geocentric frame
Eigen::Matrix3d ned_axes(Frame frame, const Eigen::Vector3d& position);

/// Roll, pitch and heading of an attitude in a frame, at a place.
/// @throws InvalidArgument as ned_axes, roll_pitch_heading
RollPitchHeading roll_pitch_heading(Frame frame, const Eigen::Vector3d& position,
                                    const Eigen::Quaterniond& frame_from_body);

/// Sorts the rows of all columns by time; of rows with the same time the first stays.
/// @throws InvalidArgument for columns of different lengths
TimeOrder order_by_time(Trajectory& trajectory);

}  // namespace risley::trajectories
