// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/plane_labels.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include "calibration/range_fit.hpp"

namespace risley::calibration {
namespace {

/// Limit for alternating labels and fits: ends an exchange of a few points back and forth.
constexpr int kMostLabelRounds = 10;
/// A plane is present where it has this share of the surrounding points, see
/// docs/theory/calibration.md, and enough to fix a plane.
constexpr double kLeastShare = 0.1;
constexpr std::size_t kLeastNear = 3;
/// Of the points in a plane's own cells: a slice of a body has less than half of them
/// (PlaneSegmentation.ScatteredPointsAreNoPlane). A cell belongs to it if it holds a quarter.
constexpr double kLeastFill = 0.5, kOwnCell = 0.25;
/// Planes at a smaller angle (half a degree) are parallel except for noise; one is then the other
/// if it has half of its points (PlaneSegmentation.OneSurfaceIsOnePlane). Rad.
constexpr double kNearlyParallel = 0.0087, kParallelShare = 0.5;
/// Planes at a smaller angle (5 degrees) differ so slowly in range that the strip in which noise
/// decides between them would be most of both. Rad.
constexpr double kCrossing = 0.087;

class Labeller {
 public:
  Labeller(const ScannedPoints& points, std::vector<Plane> planes)
      : points_(points),
        planes_(std::move(planes)),
        label_(points.beams.size(), -1),
        at_edge_(points.beams.size(), 0) {}

  LabelledPlanes run() {
    do settle();
    while (drop_one() || merge_one());
    return {std::move(planes_), std::move(label_), std::move(at_edge_), narrow_};
  }

 private:
  /// Alternates labels and fits until no label changes. Points at edges are excluded from the fits.
  void settle() {
    for (int round = 0; round < kMostLabelRounds && !planes_.empty(); ++round) {
      std::vector<int> labels = nearest_labels();
      const bool settled = round > 0 && labels == label_;
      label_ = std::move(labels);
      if (settled) return;
      refit();
    }
    label_ = nearest_labels();
  }

  /// Assigns every point to the nearest plane, in sigmas, among those present: a plane is present
  /// where it holds a share of the surrounding points. Elsewhere it would take the tails of another
  /// plane's noise, all on one side.
  std::vector<int> nearest_labels() {
    const std::size_t planes = planes_.size();
    std::vector<double> square(planes * points_.beams.size());
    std::vector<std::vector<std::uint32_t>> near(
        planes, std::vector<std::uint32_t>(points_.grid.cells(), 0));
    std::vector<std::uint32_t> any(points_.grid.cells(), 0);
    for (std::size_t i = 0; i < points_.beams.size(); ++i) {
      std::size_t best = planes;
      double least = points_.noise.gate_square;
      for (std::size_t k = 0; k < planes; ++k) {
        const double s = square[i * planes + k] =
            points_.noise.distance_square(planes_[k], points_.beams[i]);
        if (s <= least) {
          least = s;
          best = k;
        }
      }
      if (best == planes) continue;
      ++near[best][points_.grid.cell(i)];
      ++any[points_.grid.cell(i)];
    }
    any = points_.grid.block_sums(any);
    for (auto& counts : near) counts = points_.grid.block_sums(counts);
    const auto there = [&](std::size_t plane, std::size_t cell) {
      return near[plane][cell] >= kLeastNear && near[plane][cell] >= kLeastShare * any[cell];
    };
    std::vector<int> labels(points_.beams.size(), -1);
    at_edge_.assign(points_.beams.size(), 0);
    for (std::size_t i = 0; i < points_.beams.size(); ++i) {
      const std::size_t cell = points_.grid.cell(i);
      double least = points_.noise.gate_square;
      for (std::size_t k = 0; k < planes; ++k) {
        if (!(square[i * planes + k] <= least) || !there(k, cell)) continue;
        least = square[i * planes + k];
        labels[i] = static_cast<int>(k);
      }
      for (std::size_t k = 0; k < planes && labels[i] >= 0; ++k) {
        const Plane& own = planes_[labels[i]];
        at_edge_[i] |= there(k, cell) && doubtful(own, planes_[k], points_.beams[i]);
      }
    }
    return labels;
  }

  /// Whether a beam passes an edge of two planes so closely that noise decides which of them its
  /// point is nearer to. The decision ignores the point's own noise: excluding such points cuts no
  /// tail.
  bool doubtful(const Plane& a, const Plane& b, const Beam& beam) const {
    if (std::abs(dot(a.normal, b.normal)) > std::cos(kCrossing)) return false;
    const double cosine_a = dot(a.normal, beam.direction);
    const double cosine_b = dot(b.normal, beam.direction);
    if (!(cosine_a > 0) || !(cosine_b > 0)) return false;
    const double range_a = a.distance / cosine_a, range_b = b.distance / cosine_b;
    const double sigmas = std::sqrt(points_.noise.variance(cosine_a, range_a)) / cosine_a +
                          std::sqrt(points_.noise.variance(cosine_b, range_b)) / cosine_b;
    return std::abs(range_a - range_b) < points_.options.gate * sigmas;
  }

  void refit() {
    for (int step = 0; step < 2; ++step) {
      std::vector<RangeFit> fits;
      for (const Plane& plane : planes_) fits.emplace_back(plane, points_.noise);
      for (std::size_t i = 0; i < points_.beams.size(); ++i) {
        if (label_[i] < 0 || at_edge_[i]) continue;
        fits[label_[i]].add(points_.beams[i]);
      }
      for (std::size_t k = 0; k < planes_.size(); ++k) {
        planes_[k] = fits[k].step().value_or(planes_[k]);
      }
    }
  }

  std::vector<std::vector<std::size_t>> members() const {
    std::vector<std::vector<std::size_t>> rows(planes_.size());
    for (std::size_t i = 0; i < points_.beams.size(); ++i) {
      if (label_[i] >= 0) rows[label_[i]].push_back(i);
    }
    return rows;
  }

  void remove(std::size_t plane) { planes_.erase(planes_.begin() + plane); }

  /// Removes the smallest invalid plane. @return whether there was one
  bool drop_one() {
    const auto rows = members();
    std::optional<std::size_t> worst;
    for (std::size_t k = 0; k < planes_.size(); ++k) {
      const bool narrow = points_.too_narrow(rows[k]);
      if (rows[k].size() >= points_.needed && !narrow && fill(rows[k]) >= kLeastFill) continue;
      if (!worst || rows[k].size() < rows[*worst].size()) worst = k;
      if (narrow && rows[k].size() >= points_.needed) narrow_ = true;
    }
    if (worst) remove(*worst);
    return worst.has_value();
  }

  /// Part of all points, in the cells where a plane holds a quarter of them, that belong to it. A
  /// slice of a body holds less than half.
  double fill(const std::vector<std::size_t>& rows) const {
    std::vector<std::size_t> counts(points_.grid.cells(), 0);
    for (std::size_t i : rows) ++counts[points_.grid.cell(i)];
    double own = 0, all = 0;
    for (std::size_t c = 0; c < counts.size(); ++c) {
      const std::size_t inside = points_.grid.beams_in(c).size();
      if (counts[c] == 0 || static_cast<double>(counts[c]) < kOwnCell * static_cast<double>(inside))
        continue;
      own += static_cast<double>(counts[c]);
      all += static_cast<double>(inside);
    }
    return all > 0 ? own / all : 0.0;
  }

  /// Removes the smaller one of two planes that are the same surface. @return whether there were
  bool merge_one() {
    const auto rows = members();
    for (std::size_t smaller = 0; smaller < planes_.size(); ++smaller) {
      for (std::size_t larger = 0; larger < planes_.size(); ++larger) {
        if (smaller == larger || rows[smaller].size() > rows[larger].size()) continue;
        std::size_t both = 0;
        for (std::size_t i : rows[smaller]) {
          both += points_.noise.distance_square(planes_[larger], points_.beams[i]) <=
                  points_.noise.gate_square;
        }
        const double angle = angle_between(planes_[smaller].normal, planes_[larger].normal);
        const double needed = angle < kNearlyParallel ? kParallelShare : kOneSurfaceShare;
        if (static_cast<double>(both) < needed * static_cast<double>(rows[smaller].size())) {
          continue;
        }
        remove(smaller);
        return true;
      }
    }
    return false;
  }

  const ScannedPoints& points_;
  std::vector<Plane> planes_;
  std::vector<int> label_;
  std::vector<unsigned char> at_edge_;
  bool narrow_ = false;
};

}  // namespace

LabelledPlanes label_planes(const ScannedPoints& points, std::vector<Plane> planes) {
  return Labeller(points, std::move(planes)).run();
}

}  // namespace risley::calibration
