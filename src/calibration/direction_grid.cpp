// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/direction_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "risley/calibration/planar_adjustment.hpp"
#include "risley/core/median.hpp"

namespace risley::calibration {
namespace {

/// Part of the points beyond the extent on each side, as SegmentationOptions::least_extent says.
constexpr double kTail = 0.05;
/// Grid of the directions: points per cell, and limits of its width, rad (1 to 3 degrees). A block
/// of nine cells then holds 180 points, and a tenth of them differs significantly from none.
constexpr double kPointsPerCell = 20, kLeastCell = 0.0175, kMostCell = 0.0524;

}  // namespace

DirectionGrid::DirectionGrid(const std::vector<Beam>& beams) : angles_(beams.size()) {
  Vector3<double> sum;
  for (const Beam& beam : beams) sum += beam.direction;
  const double length = norm(sum);
  const Vector3<double> forward =
      length > 0 ? (1.0 / length) * sum : Vector3<double>{1.0, 0.0, 0.0};
  const auto [first, second] = tangents_of(forward);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<double, 2> least{kInfinity, kInfinity}, most{-kInfinity, -kInfinity};
  for (std::size_t i = 0; i < beams.size(); ++i) {
    const double x = dot(first, beams[i].direction), y = dot(second, beams[i].direction);
    const double sine = std::hypot(x, y);
    const double stretch =
        sine > 0 ? std::atan2(sine, dot(forward, beams[i].direction)) / sine : 1.0;
    angles_[i] = {stretch * x, stretch * y};
    for (std::size_t axis : {0, 1}) {
      least[axis] = std::min(least[axis], angles_[i][axis]);
      most[axis] = std::max(most[axis], angles_[i][axis]);
    }
  }
  const double area = (most[0] - least[0]) * (most[1] - least[1]);
  width_ = std::clamp(std::sqrt(kPointsPerCell * area / static_cast<double>(beams.size())),
                      kLeastCell, kMostCell);
  // An empty margin all around, so that every cell that holds points has eight neighbours.
  for (std::size_t axis : {0, 1}) {
    size_[axis] = 3 + static_cast<int>((most[axis] - least[axis]) / width_);
  }
  cell_.resize(beams.size());
  for (std::size_t i = 0; i < beams.size(); ++i) {
    const int column = 1 + static_cast<int>((angles_[i][0] - least[0]) / width_);
    const int row = 1 + static_cast<int>((angles_[i][1] - least[1]) / width_);
    cell_[i] = row * size_[0] + column;
  }
  beams_ = {cells(), beams.size(), [this](std::size_t i) { return cell_[i]; }};
}

std::vector<std::uint32_t> DirectionGrid::block_sums(
    const std::vector<std::uint32_t>& counts) const {
  std::vector<std::uint32_t> sums(counts.size(), 0);
  for (int row = 1; row + 1 < size_[1]; ++row) {
    for (int column = 1; column + 1 < size_[0]; ++column) {
      for (int r = row - 1; r <= row + 1; ++r) {
        for (int c = column - 1; c <= column + 1; ++c) {
          sums[row * size_[0] + column] += counts[r * size_[0] + c];
        }
      }
    }
  }
  return sums;
}

double DirectionGrid::shorter_extent(const std::vector<std::size_t>& beams) const {
  if (beams.size() < 3) return 0.0;
  const double count = static_cast<double>(beams.size());
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (std::size_t i : beams) {
    x += angles_[i][0] / count;
    y += angles_[i][1] / count;
  }
  for (std::size_t i : beams) {
    const double dx = angles_[i][0] - x, dy = angles_[i][1] - y;
    xx += dx * dx;
    xy += dx * dy;
    yy += dy * dy;
  }
  const double longer = 0.5 * std::atan2(2.0 * xy, xx - yy);
  std::vector<double> across(beams.size());
  for (std::size_t k = 0; k < beams.size(); ++k) {
    across[k] = std::cos(longer) * angles_[beams[k]][1] - std::sin(longer) * angles_[beams[k]][0];
  }
  const auto tail = static_cast<std::size_t>(kTail * count);
  const double lowest = nth_value(across, tail);
  return (nth_value(across, across.size() - 1 - tail) - lowest) / (1.0 - 2.0 * kTail);
}

}  // namespace risley::calibration
