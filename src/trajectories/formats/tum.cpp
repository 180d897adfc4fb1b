// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>

#include "risley/core/error.hpp"
#include "risley/io/text_table.hpp"

#include "trajectories/formats/format.hpp"
#include "trajectories/formats/pose_table.hpp"

/// TUM: lines of "time x y z qx qy qz qw", in seconds and metres, as evaluations of SLAM have them.
namespace risley::trajectories {
namespace {

/// The numbers of a line, where it has eight and the last four make a rotation.
bool is_tum_row(std::string_view line) {
  std::array<std::string_view, 8> fields;
  if (io::split_fields(line, io::kBlanks, fields) != fields.size()) return false;
  double squares = 0;
  try {
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const double value = io::decimal_field(fields[i], "").value;
      if (i >= 4) squares += value * value;
    }
  } catch (const io::BadRow&) {
    return false;
  }
  return std::abs(squares - 1) < 0.03;
}

bool is_tum(const FileHead& head) {
  const std::vector<std::string_view> lines = lines_of(head.bytes);
  int rows = 0;
  for (std::size_t i = 0; i < lines.size() && rows < 3; ++i) {
    const std::string_view line = io::trimmed(lines[i]);
    if (line.empty() || line.starts_with('#')) continue;
    if (i + 1 == lines.size() && rows > 0) break;  // it may be cut
    if (!is_tum_row(line)) return false;
    ++rows;
  }
  return rows > 0;
}

Trajectory read_tum(const std::string& path, const Progress& progress) {
  PoseTable table;
  table.delimiter = io::kBlanks;
  table.comment = '#';
  table.left_up = true;
  table.contents.format = "tum";
  table.contents.frame = Frame::local;
  constexpr std::array kTumColumns{
      std::pair{PoseField::time, "time"}, std::pair{PoseField::x, "x"},
      std::pair{PoseField::y, "y"},       std::pair{PoseField::z, "z"},
      std::pair{PoseField::qx, "qx"},     std::pair{PoseField::qy, "qy"},
      std::pair{PoseField::qz, "qz"},     std::pair{PoseField::qw, "qw"}};
  for (const auto& [field, name] : kTumColumns) table.columns.push_back({field, name});
  Trajectory trajectory = read_pose_table(path, table, progress);
  trajectory.time_scale = scale_by_size(trajectory.time_ns);
  return trajectory;
}

}  // namespace

const Format kTumFormat{"tum", "", "TUM: time x y z qx qy qz qw", is_tum, read_tum, nullptr};

}  // namespace risley::trajectories
