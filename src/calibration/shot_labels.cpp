// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/shot_labels.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <utility>

#include "risley/calibration/rays.hpp"
#include "risley/parallel/parallel.hpp"

#include "calibration/range_terms.hpp"
#include "calibration/shot_blocks.hpp"

namespace risley::calibration {
namespace {

/// Part of the rotation angles' sigma that a direction has: the sine of a prism's deflection. Two
/// of a Mid-40 reach 19.2 degrees, one half of it.
constexpr double kAngleLever = 0.17;
/// A beam that meets a plane at a flatter angle, as the cosine of incidence, does not help to place
/// it: the pointing's share of its range would explain any range.
constexpr double kFlattestApproach = 0.01;

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
  std::mutex counting;
  for_each_block(shots.size(), [&](std::size_t begin, std::size_t end) {
    std::vector<std::size_t> near(problem.views.size(), 0);
    const Rays rays(problem.train, problem.geometry, shots, {begin, end});
    std::vector<double> predicted(planes.size()), sigma(planes.size());
    std::size_t nearest = 0;
    for (std::size_t i = begin; i < end; ++i) {
      double best = kNearby;
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
        const double off = std::abs(shots.range[i] - error - range) / sigma[p];
        if (range > 0 && cosine > kFlattestApproach && off < best) {
          best = off;
          nearest = p;
        }
      }
      if (best == kNearby) continue;
      const int closest = planes[nearest].first;
      bool edge = false;
      for (std::size_t p = 0; p < planes.size(); ++p) {
        edge = edge || (p != nearest && std::abs(predicted[p] - predicted[nearest]) <
                                            kGate * (sigma[p] + sigma[nearest]));
      }
      if (!edge) labels.nearby[i] = closest;
      if (!edge && best <= kGate) {
        labels.view[i] = closest;
      } else {
        ++near[closest];
      }
    }
    const std::scoped_lock lock(counting);
    for (std::size_t v = 0; v < near.size(); ++v) labels.near[v] += near[v];
  });
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
