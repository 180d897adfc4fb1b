// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <limits>

#include "risley/calibration/plane_segmentation.hpp"

namespace risley::calibration {

/// A point as seen by the sensor.
struct Beam {
  Vector3<double> direction;  ///< unit vector
  double range = 0;           ///< m
};

/// Noise of a point and the number of sigmas that still belong to a plane.
struct PointNoise {
  double range_variance, pointing_variance, gate_square;

  PointNoise(const SegmentationOptions& options, double gate_factor)
      : range_variance(options.range_noise * options.range_noise),
        pointing_variance(options.pointing_noise * options.pointing_noise),
        gate_square(gate_factor * gate_factor * options.gate * options.gate) {}

  /// Square of the point's distance from the plane over its variance, times gate^2.
  double distance_square(const Plane& plane, const Beam& beam) const {
    const double cosine = dot(plane.normal, beam.direction);
    const double distance = cosine * beam.range - plane.distance;
    return distance * distance / variance(cosine, beam.range);
  }
  /// 1 sigma^2 of the distance.
  double variance(double cosine, double range) const {
    const double square = cosine * cosine;
    return square * range_variance +
           std::max(0.0, 1.0 - square) * pointing_variance * range * range +
           std::numeric_limits<double>::min();
  }
};

}  // namespace risley::calibration
