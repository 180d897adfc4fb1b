// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/plane_segmentation.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "risley/core/require.hpp"

#include "calibration/plane_labels.hpp"
#include "calibration/plane_search.hpp"
#include "calibration/scanned_points.hpp"

namespace risley::calibration {
namespace {

void check(const SegmentationOptions& options) {
  require_above("range noise", options.range_noise, 0, "m");
  require_not_below("pointing noise", options.pointing_noise, 0, "rad");
  require_above("gate", options.gate, 0);
  require_between("least fraction", options.least_fraction, 0, 1);
  require_not_below("least extent", options.least_extent, 0, "rad");
}

}  // namespace

double distance_sigma(const Plane& plane, const Vector3<double>& point,
                      const SegmentationOptions& options) {
  const double range = norm(point);
  return std::sqrt(PointNoise(options, 1.0).variance(dot(plane.normal, point) / range, range));
}

Segmentation segment_planes(std::span<const Vector3<double>> points,
                            const SegmentationOptions& options) {
  check(options);
  std::vector<Beam> beams;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double range = norm(points[i]);
    if (!std::isfinite(range) || !(range > 0)) continue;
    beams.push_back({(1.0 / range) * points[i], range});
    rows.push_back(i);
  }
  Segmentation result;
  result.label.assign(points.size(), -1);
  if (beams.size() < std::max<std::size_t>(3, options.least_points)) return result;

  const ScannedPoints scanned(std::move(beams), options);
  std::vector<std::size_t> all(scanned.beams.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  result.on_one_line = scanned.too_narrow(all);
  if (result.on_one_line) return result;
  FoundCandidates candidates = search_planes(scanned);
  LabelledPlanes found = label_planes(scanned, std::move(candidates.planes));
  const std::size_t planes = found.planes.size();
  result.on_one_line = planes == 0 && (candidates.narrow || found.narrow);
  if (options.leave_out_edges) {
    for (std::size_t i = 0; i < found.label.size(); ++i) {
      if (found.at_edge[i]) found.label[i] = -1;
    }
  }
  std::vector<std::size_t> counts(planes, 0), order(planes);
  for (int label : found.label) {
    if (label >= 0) ++counts[label];
  }
  for (std::size_t k = 0; k < planes; ++k) order[k] = k;
  std::ranges::stable_sort(order,
                           [&](std::size_t a, std::size_t b) { return counts[a] > counts[b]; });
  std::vector<int> place(planes);
  for (std::size_t k = 0; k < planes; ++k) {
    place[order[k]] = static_cast<int>(k);
    result.planes.push_back(found.planes[order[k]]);
    result.points.push_back(counts[order[k]]);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const int label = found.label[i];
    if (label >= 0) result.label[rows[i]] = place[label];
  }
  return result;
}

}  // namespace risley::calibration
