// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/wall_search.hpp"

#include <cmath>
#include <vector>

#include "risley/calibration/rays.hpp"
#include "risley/core/angle.hpp"

#include "calibration/plane_labels.hpp"
#include "calibration/shot_labels.hpp"

namespace risley::calibration {
namespace {

/// Possible distortion of directions before the first adjustment, 1 sigma:
/// docs/theory/calibration.md
constexpr double kStartPointing = radians_from_degrees(0.1);

/// A smaller plane a few sigmas off a larger one is a step of it: two planes that nearly coincide
/// could not divide their shots.
void absorb_steps(const std::vector<Vector3<double>>& points, const SegmentationOptions& settings,
                  Segmentation& segmentation) {
  for (std::size_t k = segmentation.planes.size(); k-- > 1;) {
    bool step = false;
    for (std::size_t larger = 0; larger < k && !step; ++larger) {
      const Plane& plane = segmentation.planes[larger];
      double near = 0, all = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (segmentation.label[i] != static_cast<int>(k)) continue;
        all += 1.0;
        near += std::abs(signed_distance(plane, points[i])) <=
                        kNearby * distance_sigma(plane, points[i], settings)
                    ? 1.0
                    : 0.0;
      }
      step = near >= kOneSurfaceShare * all;
    }
    if (!step) continue;
    const auto at = static_cast<std::ptrdiff_t>(k);
    segmentation.planes.erase(segmentation.planes.begin() + at);
    segmentation.points.erase(segmentation.points.begin() + at);
    for (int& label : segmentation.label) {
      if (label == static_cast<int>(k)) {
        label = -1;
      } else if (label > static_cast<int>(k)) {
        --label;
      }
    }
  }
}

}  // namespace

Segmentation search_walls(const RangedShots& shots, const PrismTrain& train,
                          const PrismGeometry& geometry, const StartNoise& noise,
                          std::uint64_t seed) {
  const Rays rays(train, geometry, shots);
  std::vector<Vector3<double>> points;
  for (std::size_t i = 0; i < shots.size(); ++i) points.push_back(rays.point(i, shots.range[i]));
  SegmentationOptions settings;
  settings.range_noise = noise.range;
  settings.pointing_noise = std::hypot(kStartPointing, noise.pointing);
  settings.gate = kGate;
  settings.leave_out_edges = true;
  settings.seed = seed;
  Segmentation segmentation = segment_planes(points, settings);
  absorb_steps(points, settings, segmentation);
  return segmentation;
}

}  // namespace risley::calibration
