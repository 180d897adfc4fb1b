// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "risley/core/plane.hpp"
#include "risley/core/vector3.hpp"

namespace risley::calibration {

/// Parameters for separating planes from clutter.
struct SegmentationOptions {
  double range_noise = 0.02;  ///< 1 sigma along the beam, m
  /// 1 sigma of directions that are not calibrated yet, without the rotation common to all, rad.
  double pointing_noise = 0;
  double gate = 3.0;  ///< a point belongs to a plane within this many sigmas
  std::size_t most_planes = 12;
  /// Minimum number of points of a plane, and minimum share of all points.
  std::size_t least_points = 100;
  double least_fraction = 0.03;
  /// Least shorter extent of a plane, seen from the sensor, rad (1.5 degree): a row of points is
  /// not a plane. The extent is the width between the 5 % and 95 % quantiles across the longer
  /// principal axis, over 0.9.
  double least_extent = 0.026;
  /// Points so near to an edge that noise decides which plane is closer are clutter. Otherwise each
  /// plane lacks the points that noise moved to the other one, which biases an adjustment by about
  /// as much as the noise itself, more with more points. The planes themselves are always fitted
  /// without them.
  bool leave_out_edges = false;
  std::uint64_t seed = 0;
};

/// Planes and the points that lie on them.
struct Segmentation {
  std::vector<Plane> planes;        ///< largest first, sensor frame
  std::vector<int> label;           ///< [points], row of planes, -1 for clutter
  std::vector<std::size_t> points;  ///< [planes]
  /// The points fill no area: all of them, or all but outliers, lie on a line or a narrow strip,
  /// and there are no planes.
  bool on_one_line = false;
};

/// 1 sigma of a point's distance from a plane: range noise counts along the normal, noise of the
/// direction with the sine of the angle of incidence.
double distance_sigma(const Plane& plane, const Vector3<double>& point,
                      const SegmentationOptions& options);

/// Finds flat surfaces in points around the origin: RANSAC for the largest plane, a fit to its
/// points, the next one among the rest, and at the end every point to the plane it is nearest to,
/// in sigmas, with new fits, until no label changes. A plane takes points only where it holds a
/// share of its surroundings, a few degrees wide; its extension elsewhere would take the tails of
/// other planes' noise, all on one side. Planes that explain each other's points are merged, and
/// slices of a body, which hold less than half of the points around them, are dropped. Fits compare
/// ranges, so that their noise does not bias the normal. Non-finite points, and points at the
/// origin, are clutter. The result depends only on points and options.
/// @throws InvalidArgument for invalid options
Segmentation segment_planes(std::span<const Vector3<double>> points,
                            const SegmentationOptions& options);

}  // namespace risley::calibration
