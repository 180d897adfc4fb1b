// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <Eigen/Core>

#include "risley/core/error.hpp"
#include "risley/io/text_table.hpp"

#include "trajectories/formats/format.hpp"

/// KITTI's poses: lines of 12 numbers, a rotation and a place as the rows of a 3x4 matrix, without
/// times. They are recognised to say why they will not do.
namespace risley::trajectories {
namespace {

constexpr std::size_t kNumbers = 12;

bool is_kitti_row(std::string_view line) {
  std::array<std::string_view, kNumbers> fields;
  if (io::split_fields(line, io::kBlanks, fields) != fields.size()) return false;
  Eigen::Matrix<double, 3, 4> pose;
  try {
    for (std::size_t i = 0; i < fields.size(); ++i) {
      pose(i / 4, i % 4) = io::decimal_field(fields[i], "").value;
    }
  } catch (const io::BadRow&) {
    return false;
  }
  const Eigen::Matrix3d rotation = pose.leftCols<3>();
  constexpr double kRounding = 0.01;
  return (rotation * rotation.transpose()).isIdentity(kRounding) && rotation.determinant() > 0;
}

bool is_kitti(const FileHead& head) {
  const std::vector<std::string_view> lines = lines_of(head.bytes);
  constexpr std::size_t kRows = 3;
  return !lines.empty() &&
         std::all_of(lines.begin(), lines.begin() + (std::min(lines.size(), kRows)), is_kitti_row);
}

Trajectory refuse_kitti(const std::string& path, const Progress& /*progress*/) {
  throw FileError(
      path, {},
      "is a trajectory of KITTI (a 3x4 matrix a line), which has no times; expected one "
      "with times, such as lines of TUM: time x y z qx qy qz qw, with the times of "
      "KITTI's times.txt");
}

}  // namespace

const Format kKittiFormat{"kitti",  "",           "KITTI: refused, it has no times",
                          is_kitti, refuse_kitti, nullptr};

}  // namespace risley::trajectories
