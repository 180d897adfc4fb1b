// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <array>
#include <string_view>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/text_table.hpp"

#include "trajectories/formats/format.hpp"
#include "trajectories/formats/pose_table.hpp"

/// POSPac's export by the profile of OpenMMS: a line on the project, then 15 columns without names.
/// Times are UTC seconds of the day; there are no accuracies.
namespace risley::trajectories {
namespace {

constexpr std::size_t kOpenmmsColumns = 15;

bool is_openmms_row(std::string_view line) {
  const auto numbers = numbers_in<kOpenmmsColumns>(line, ',');
  if (!numbers) return false;
  const auto within = [&](std::size_t i, double least, double most) {
    return (*numbers)[i] >= least && (*numbers)[i] <= most;
  };
  return within(0, 0, 2 * 86400.0) && within(1, -90, 90) && within(2, -180, 360) &&
         within(3, -1e3, 1e5) && within(4, -200, 200) && within(5, -180, 180) &&
         within(6, -90, 90) && within(7, -360, 360);
}

bool is_openmms(const FileHead& head) {
  const std::vector<std::string_view> lines = lines_of(head.bytes);
  if (lines.size() < 2) return false;
  const std::size_t first = is_openmms_row(lines[0]) ? 0 : 1;
  return is_openmms_row(lines[first]);
}

Trajectory read_openmms(const std::string& path, const Progress& progress) {
  PoseTable table;
  table.contents.format = "openmms";
  table.contents.time_scale = TimeScale::utc_second_of_day;
  table.contents.velocity_axes = VelocityAxes::east_north_up;
  table.contents.has_velocity = true;
  constexpr double kDegree = kRadiansPerDegree;
  table.columns = {{PoseField::time, "time"},
                   {PoseField::latitude, "latitude", kDegree},
                   {PoseField::longitude, "longitude", kDegree},
                   {PoseField::height, "ellipsoid height"},
                   {PoseField::unused, "geoid separation"},
                   {PoseField::roll, "roll", kDegree},
                   {PoseField::pitch, "pitch", kDegree},
                   {PoseField::heading, "heading", kDegree},
                   {PoseField::unused, "x acceleration"},
                   {PoseField::unused, "y acceleration"},
                   {PoseField::unused, "z acceleration"},
                   {PoseField::unused, "z angular rate"},
                   {PoseField::velocity_1, "east velocity"},
                   {PoseField::velocity_2, "north velocity"},
                   {PoseField::velocity_3, "up velocity"}};
  io::LineReader lines(path, io::LinesOf::table);
  std::string_view line;
  if (lines.next(line) && !is_openmms_row(line)) table.first_row = 2;
  return read_pose_table(path, table, progress);
}

}  // namespace

const Format kOpenmmsFormat{
    "openmms",  "",           "POSPac's export by the OpenMMS profile: 15 columns",
    is_openmms, read_openmms, nullptr};

}  // namespace risley::trajectories
