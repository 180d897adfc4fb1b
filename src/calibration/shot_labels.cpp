// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/shot_labels.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>

#include "risley/calibration/rays.hpp"
#include "risley/core/median.hpp"
#include "risley/parallel/parallel.hpp"

#include "calibration/range_terms.hpp"
#include "calibration/shot_blocks.hpp"

namespace risley::calibration {
namespace {

/// Part of the rotation angles' sigma in a direction: the sine of a prism's deflection. Two of a
/// Mid-40 reach 19.2 degrees, one half of it.
constexpr double kAngleLever = 0.17;
/// A beam at a flatter angle to a plane, as the cosine of incidence, does not help to locate it:
/// the pointing's share of its range would explain any range.
constexpr double kFlattestApproach = 0.01;
/// Width of a cell of directions, as a part of the unit sphere's radius: two degrees.
constexpr double kSkyCell = 0.035;
/// A shot is beside a plane where their distance along the beam is at most this part of the range.
/// It is the width of a cell and those around it: a surface that meets the plane there, at up to 45
/// degrees, is no farther away.
constexpr double kBeside = 3.0 * kSkyCell;
/// If another surface is near, at least this share of the surrounding shots belongs to no plane,
/// and this many times the share that is usual on planes.
constexpr double kForeignShare = 0.05, kAboveUsual = 3.0;

/// Counts over the directions, in cells of a cubic grid around the unit sphere: no direction is
/// special, and the full circle needs no wrapping.
class SkyCells {
 public:
  static int cell(const Vector3<double>& direction) {
    return (index(direction.x) * kSide + index(direction.y)) * kSide + index(direction.z);
  }
  SkyCells() : counts_(static_cast<std::size_t>(kSide) * kSide * kSide, 0) {}
  std::size_t size() const { return counts_.size(); }
  void add(int cell) { ++counts_[cell]; }
  /// Count of a cell and those around it.
  std::uint32_t around(int cell) const {
    std::uint32_t sum = 0;
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        for (int z = -1; z <= 1; ++z) sum += counts_[cell + (x * kSide + y) * kSide + z];
      }
    }
    return sum;
  }

 private:
  /// With a margin all around, so that every cell has neighbours.
  static constexpr int kSide = static_cast<int>(2.0 / kSkyCell) + 3;
  static int index(double coordinate) { return 1 + static_cast<int>((coordinate + 1) / kSkyCell); }
  std::vector<std::uint32_t> counts_;
};

/// Removes shots beside non-planar surfaces from their planes. If such a surface meets a plane, its
/// shots within the gate would count as the plane's, all with errors of one sign. Only the
/// neighbours of a shot decide.
/// @param sky  [shots], cell of each, or -1
/// @param foreign  [shots], whether the shot is beside a plane that does not explain it
void leave_out_borders(const std::vector<int>& sky, const std::vector<unsigned char>& foreign,
                       std::vector<int>& view) {
  SkyCells all, strays;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < sky.size(); ++i) {
    if (sky[i] < 0) continue;
    all.add(sky[i]);
    if (foreign[i]) strays.add(sky[i]);
    if (view[i] >= 0) rows.push_back(i);
  }
  if (rows.empty()) return;
  std::vector<double> share_of_cell(all.size(), -1);  // where it is known
  std::vector<double> shares;
  shares.reserve(rows.size());
  for (const std::size_t i : rows) {
    double& share = share_of_cell[sky[i]];
    if (share < 0) share = static_cast<double>(strays.around(sky[i])) / all.around(sky[i]);
    shares.push_back(share);
  }
  const double most = std::max(kForeignShare, kAboveUsual * median(shares));
  for (const std::size_t i : rows) {
    if (share_of_cell[sky[i]] > most) view[i] = -1;
  }
}

}  // namespace

double pointing_of_angles(const RangedShots& shots) {
  double sum = 0;
  const std::vector<std::size_t> rows = spread_rows(shots.size(), 2000);
  for (const std::size_t row : rows) {
    std::size_t entry = 0;
    for (int k = 0; k < shots.prisms(); ++k) {
      sum += static_cast<double>(shots.angle_covariance[entry][row]);
      entry += static_cast<std::size_t>(shots.prisms() - k);
    }
  }
  return kAngleLever * std::sqrt(sum / static_cast<double>(rows.size()));
}

Labels label_shots(const PlanarProblem& problem, std::size_t recording, const RangedShots& shots,
                   double pointing) {
  Labels labels{std::vector<int>(shots.size(), -1), std::vector<int>(shots.size(), -1),
                std::vector<std::size_t>(problem.views.size(), 0)};
  std::vector<std::pair<int, PlaneView>> planes;
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    if (problem.views[v].recording == recording) {
      planes.emplace_back(static_cast<int>(v), plane_view(problem, v));
    }
  }
  std::vector<int> sky(shots.size(), -1);
  std::vector<unsigned char> foreign(shots.size(), 0);
  std::mutex counting;
  for_each_block(shots.size(), [&](std::size_t begin, std::size_t end) {
    std::vector<std::size_t> near(problem.views.size(), 0);
    const Rays rays(problem.train, problem.geometry, shots, {begin, end});
    std::vector<double> predicted(planes.size()), sigma(planes.size());
    std::size_t nearest = 0;
    for (std::size_t i = begin; i < end; ++i) {
      double best = kNearby;
      bool beside = false;
      for (std::size_t p = 0; p < planes.size(); ++p) {
        const PlaneView& plane = planes[p].second;
        const Vector3<double> direction = rays.direction(i - begin);
        const double range = hit_distance(plane.plane, rays.origin(i - begin), direction);
        const double cosine = dot(plane.plane.normal, direction);
        const double across =
            pointing * range * std::sqrt(std::max(0.0, 1.0 - cosine * cosine)) / cosine;
        predicted[p] = range;
        sigma[p] = std::sqrt(plane.range_variance + across * across);
        const double error = range_error(
            problem, term_shot(shots, i, rays.origin(i - begin), direction, plane.plane));
        const double distance = std::abs(shots.range[i] - error - range);
        const double off = distance / sigma[p];
        beside = beside || distance < kBeside * range;
        if (range > 0 && cosine > kFlattestApproach && off < best) {
          best = off;
          nearest = p;
        }
      }
      if (std::isfinite(rays.direction(i - begin).x)) {
        sky[i] = SkyCells::cell(rays.direction(i - begin));
      }
      foreign[i] = beside;
      if (best == kNearby) continue;
      const int closest = planes[nearest].first;
      bool edge = false;
      for (std::size_t p = 0; p < planes.size(); ++p) {
        edge = edge || (p != nearest && std::abs(predicted[p] - predicted[nearest]) <
                                            kGate * (sigma[p] + sigma[nearest]));
      }
      if (!edge) labels.nearby[i] = closest;
      foreign[i] = !edge && best > kGate;
      if (!edge && best <= kGate) {
        labels.view[i] = closest;
      } else {
        ++near[closest];
      }
    }
    const std::scoped_lock lock(counting);
    for (std::size_t v = 0; v < near.size(); ++v) labels.near[v] += near[v];
  });
  leave_out_borders(sky, foreign, labels.view);
  return labels;
}

void hand_out(const RangedShots& shots, const std::vector<int>& view, std::size_t recording,
              PlanarProblem& problem) {
  std::vector<std::vector<std::vector<std::size_t>>> rows_of_blocks(block_count(view.size()));
  for_each_block(view.size(), [&](std::size_t begin, std::size_t end) {
    auto& rows = rows_of_blocks[begin / kBlockShots];
    rows.resize(problem.views.size());
    for (std::size_t i = begin; i < end; ++i) {
      if (view[i] >= 0) rows[view[i]].push_back(i);
    }
  });
  parallel::for_each(problem.views.size(), [&](std::size_t v) {
    if (problem.views[v].recording != recording) return;
    std::vector<std::size_t> rows;
    for (const auto& block : rows_of_blocks) {
      rows.insert(rows.end(), block[v].begin(), block[v].end());
    }
    RangedShots own = rows_of(shots, rows);
    fill_range_terms(problem, v, own);
    problem.views[v].shots = std::make_shared<const RangedShots>(std::move(own));
    problem.views[v].cell_begin.clear();
  });
}

}  // namespace risley::calibration
