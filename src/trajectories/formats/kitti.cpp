// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string_view>

#include <Eigen/Core>
#include <Eigen/LU>

#include "risley/core/error.hpp"

#include "trajectories/formats/format.hpp"

/// KITTI's poses: lines of 12 numbers, a rotation and a place as the rows of a 3x4 matrix, without
/// times. They are recognised in order to explain why they are unsuitable.
namespace risley::trajectories {
namespace {

bool is_kitti_row(std::string_view line) {
  const auto numbers = numbers_in<12>(line, io::kBlanks);
  if (!numbers) return false;
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> pose(numbers->data());
  const Eigen::Matrix3d rotation = pose.leftCols<3>();
  constexpr double kRounding = 0.01;
  return (rotation * rotation.transpose()).isIdentity(kRounding) && rotation.determinant() > 0;
}

bool is_kitti(const FileHead& head) {
  const std::vector<std::string_view> lines = lines_of(head.bytes);
  constexpr std::ptrdiff_t kRows = 3;
  return !lines.empty() &&
         std::all_of(lines.begin(), lines.begin() + std::min(std::ssize(lines), kRows),
                     is_kitti_row);
}

Trajectory refuse_kitti(const std::string& path, const Progress& /*progress*/) {
  throw FileError(
      path, {},
      "is a trajectory of KITTI (a 3x4 matrix per line), which has no times; expected one with "
      "times, such as lines of TUM: time x y z qx qy qz qw, with the times of KITTI's times.txt");
}

}  // namespace

const Format kKittiFormat{"kitti",  "",           "KITTI: refused, it has no times",
                          is_kitti, refuse_kitti, nullptr};

}  // namespace risley::trajectories
