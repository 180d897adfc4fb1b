// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "risley/cloud/points.hpp"

namespace risley::cloud {

/// A uniform random sample of a cloud's points, for pictures and statistics. Columns of one length.
struct PointSample {
  std::uint64_t points = 0;    ///< of the whole cloud
  PointFrame frame;            ///< of the points
  std::vector<float> x, y, z;  ///< from the frame's offset on, m
  std::vector<float> range;    ///< m
  /// Square root of the sum of the variances of x, y and z, m; empty without covariance.
  std::vector<float> total_sigma;
  std::vector<float> incidence;         ///< rad; NaN where not known
  std::vector<std::uint8_t> intensity;  ///< 0-255

  std::size_t size() const { return x.size(); }
};

/// Uncertainty of points by range, of a sample with covariance.
struct RangeClass {
  double from = 0, to = 0;     ///< ranges [from, to), m; the last class ends at infinity
  std::size_t points = 0;      ///< of the sample
  double median_sigma = 0;     ///< of total_sigma, m
  double high_sigma = 0;       ///< 95 % of the points have a smaller uncertainty, m
  double known_incidence = 0;  ///< share of the points
};
/// Classes that hold a point, by range. @throws InvalidArgument for a sample without covariance
std::vector<RangeClass> range_classes(const PointSample& sample);
/// All points as one class. @throws InvalidArgument as range_classes(), for an empty sample
RangeClass whole_range(const PointSample& sample);

/// Draws a sample while a cloud is made. The selection depends only on the points' numbers: steps
/// of a fixed length would follow the emitters and the rotors.
class PointSampler {
 public:
  /// @param most  points to keep, above 0 @throws InvalidArgument
  PointSampler(PointFrame frame, std::size_t most);
  /// Takes the next points of the cloud.
  void add(const Points& points);
  /// The sample of all points: all of them, or as many as are kept. Nothing is added afterwards.
  PointSample take();

 private:
  void thin();

  std::size_t most_;
  double highest_ = 1;       ///< lot that is kept
  std::vector<double> lot_;  ///< of each kept point
  PointSample sample_;
};

}  // namespace risley::cloud
