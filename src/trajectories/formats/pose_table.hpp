// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "risley/core/progress.hpp"

#include "trajectories/formats/pose_rows.hpp"

namespace risley::trajectories {

/// Content of a column in a table of poses.
enum class PoseField : std::uint8_t {
  unused,
  time,
  gps_week,
  date,  ///< of the time; determines whether that is the second of the day or of the week
  latitude,
  longitude,
  height,
  x,
  y,
  z,
  qx,
  qy,
  qz,
  qw,
  roll,
  pitch,
  heading,
  velocity_1,  ///< along the axes of RowContents::velocity_axes
  velocity_2,
  velocity_3,
  sigma_north,
  sigma_east,
  sigma_down,
  sigma_roll,
  sigma_pitch,
  sigma_heading,
  count,
};

/// A format's name for a column's content.
struct FieldName {
  std::string_view name;
  PoseField field;
};

/// Order of year, month and day in a date.
enum class DateOrder : std::uint8_t { ymd, mdy, dmy };

/// One column of a table.
struct PoseColumn {
  PoseField field = PoseField::unused;
  std::string name;          ///< as the file calls it
  double scale = 1;          ///< SI units per unit of the file; of angles rad
  int time_decimals = 0;     ///< of a time: 0 for seconds, 9 for nanoseconds
  bool sexagesimal = false;  ///< degrees, minutes and seconds in three fields
  DateOrder date_order = DateOrder::ymd;
};

/// A table of poses in a text file.
struct PoseTable {
  std::vector<PoseColumn> columns;
  RowContents contents;
  char delimiter = ',';
  std::uint64_t first_row = 1;  ///< line, from 1
  char comment = '\0';          ///< lines that begin with it are skipped
  /// Text may follow after an empty line.
  bool has_footer = false;
  /// Bodies are forward-left-up, as in ROS.
  bool left_up = false;
};

/// Reads the rows of a table. A truncated last line is dropped with a warning.
/// @throws FileError at the line that is not a row or is physically impossible; Cancelled
Trajectory read_pose_table(const std::string& path, const PoseTable& table,
                           const Progress& progress, const std::vector<Warning>& warnings = {});

/// The fields of the columns; RowContents::has_velocity and so on follow from them.
bool has_field(const std::vector<PoseColumn>& columns, PoseField field);

/// The names of those fields that no column has.
std::vector<std::string_view> missing_fields(
    const std::vector<PoseColumn>& columns,
    std::initializer_list<std::pair<PoseField, std::string_view>> wanted);

/// Whether a field is an angle, and whether it is the sigma of one.
bool is_angle(PoseField field);
bool is_angle_sigma(PoseField field);

/// Sets the table's contents from the columns. Partial velocities and accuracies are dropped with a
/// warning.
void take_contents(PoseTable& table, std::vector<Warning>& warnings);

}  // namespace risley::trajectories
