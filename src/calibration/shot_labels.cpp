// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/shot_labels.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <utility>

#include <tbb/parallel_for.h>

#include "risley/optics/batch.hpp"

namespace risley::calibration {
namespace {

constexpr std::size_t kBlockShots = 65536;
/// Part of the rotation angles' sigma that a direction has: the sine of a prism's deflection.
constexpr double kAngleLever = 0.17;

}  // namespace

Rays::Rays(const PrismTrain& train, const PrismGeometry& geometry, const RangedShots& shots) {
  for (auto* column : {&x_, &y_, &z_, &origin_x_, &origin_y_, &origin_z_})
    column->resize(shots.size());
  tbb::parallel_for(
      std::size_t{0}, (shots.size() + kBlockShots - 1) / kBlockShots, [&](std::size_t block) {
        const std::size_t begin = block * kBlockShots;
        const std::size_t count = std::min(kBlockShots, shots.size() - begin);
        std::vector<std::span<const double>> angles;
        for (const auto& column : shots.rotation_angle) {
          angles.emplace_back(std::span(column).subspan(begin, count));
        }
        const auto part = [&](std::vector<double>& column) {
          return std::span(column).subspan(begin, count);
        };
        DirectionColumns out{part(x_), part(y_), part(z_), {}, {}};
        out.origin_x = part(origin_x_);
        out.origin_y = part(origin_y_);
        out.origin_z = part(origin_z_);
        out.geometry = geometry;
        const auto beam = std::span(shots.beam);
        observe_batch(train, angles, out, beam.empty() ? beam : beam.subspan(begin, count));
      });
}

RangedShots rows_of(const RangedShots& shots, const std::vector<std::size_t>& rows) {
  RangedShots result;
  result.resize(shots.prisms(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) result.set_row(i, shots, rows[i]);
  return result;
}

/// Typical sigma of a direction that comes from the rotation angles' covariance, rad.
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
  const Rays rays(problem.train, problem.geometry, shots);
  Labels labels{std::vector<int>(shots.size(), -1), std::vector<int>(shots.size(), -1),
                std::vector<std::size_t>(problem.views.size(), 0)};
  std::vector<std::pair<int, PlaneView>> planes;
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    if (problem.views[v].recording == recording) {
      planes.emplace_back(static_cast<int>(v), plane_view(problem, v));
    }
  }
  std::vector<int> closest(shots.size(), -1);
  tbb::parallel_for(
      std::size_t{0}, (shots.size() + kBlockShots - 1) / kBlockShots, [&](std::size_t block) {
        const std::size_t end = std::min((block + 1) * kBlockShots, shots.size());
        std::vector<double> predicted(planes.size()), sigma(planes.size());
        std::size_t nearest = 0;
        for (std::size_t i = block * kBlockShots; i < end; ++i) {
          double best = kNearby;
          for (std::size_t p = 0; p < planes.size(); ++p) {
            const PlaneView& plane = planes[p].second;
            const Vector3<double> direction = rays.direction(i);
            const double range = hit_distance(plane.plane, rays.origin(i), direction);
            const double cosine = dot(plane.plane.normal, direction);
            const double across =
                pointing * range * std::sqrt(std::max(0.0, 1.0 - cosine * cosine)) / cosine;
            predicted[p] = range;
            sigma[p] = std::sqrt(plane.range_variance + across * across);
            const double off = std::abs(shots.range[i] - plane.range_offset - range) / sigma[p];
            if (range > 0 && off < best) {
              best = off;
              nearest = p;
            }
          }
          if (best == kNearby) continue;
          closest[i] = planes[nearest].first;
          bool edge = false;
          for (std::size_t p = 0; p < planes.size(); ++p) {
            edge = edge || (p != nearest && std::abs(predicted[p] - predicted[nearest]) <
                                                kGate * (sigma[p] + sigma[nearest]));
          }
          if (edge) continue;
          labels.nearby[i] = closest[i];
          if (best <= kGate) labels.view[i] = closest[i];
        }
      });
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (labels.view[i] < 0 && closest[i] >= 0) ++labels.near[static_cast<std::size_t>(closest[i])];
  }
  return labels;
}

void hand_out(const RangedShots& shots, const std::vector<int>& view, std::size_t recording,
              PlanarProblem& problem) {
  std::vector<std::vector<std::size_t>> rows(problem.views.size());
  for (std::size_t i = 0; i < view.size(); ++i) {
    if (view[i] >= 0) rows[static_cast<std::size_t>(view[i])].push_back(i);
  }
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    if (problem.views[v].recording != recording) continue;
    problem.views[v].shots = std::make_shared<const RangedShots>(rows_of(shots, rows[v]));
  }
}

}  // namespace risley::calibration
