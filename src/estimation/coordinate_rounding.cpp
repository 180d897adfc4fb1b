// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/coordinate_rounding.hpp"

#include <cmath>

#include "risley/core/direction.hpp"
#include "risley/core/require.hpp"
#include "risley/recordings/cut_coordinates.hpp"

namespace risley::estimation {
namespace {

/// Step of the coordinates of a shot, m, or 0: the zenith's rounding variance is that of q / range.
double step_of(const AngleSeries& series, std::size_t i) {
  const double range = series.range[i];
  if (!(range > 0)) return 0.0;
  return range * std::sqrt(12.0 * static_cast<double>(series.zenith_rounding_variance[i]));
}

}  // namespace

std::string to_string(CoordinateRounding rounding) {
  switch (rounding) {
    case CoordinateRounding::unknown:
      return "unknown";
    case CoordinateRounding::nearest:
      return "nearest";
    case CoordinateRounding::toward_zero:
      return "toward zero";
  }
  return {};
}

void add_half_steps(AngleSeries& series, const Eigen::Matrix3d& recording_from_sensor) {
  require_length_or_none("range", series.range.size(), series.size());
  for (std::size_t i = 0; i < series.range.size(); ++i) {
    const double step = step_of(series, i);
    if (!(step > 0)) continue;
    const auto v = direction_from_angles<double>({series.azimuth[i], series.zenith[i]});
    const Eigen::Vector3d point =
        series.range[i] * (recording_from_sensor * Eigen::Vector3d(v.x, v.y, v.z));
    const auto middle = recordings::middle_of_cut({point.x(), point.y(), point.z()}, step);
    const Eigen::Vector3d moved =
        recording_from_sensor.transpose() * Eigen::Vector3d(middle.x, middle.y, middle.z);
    const auto angles = angles_from_direction(Vector3<double>{moved.x(), moved.y(), moved.z()});
    series.azimuth[i] = angles.azimuth;
    series.zenith[i] = angles.zenith;
    series.range[i] = moved.norm();
  }
}

double half_step_signal(const AngleSeries& series, double noise) {
  require_length_or_none("range", series.range.size(), series.size());
  require_not_below("noise", noise, 0, "rad");
  double sum = 0;
  for (std::size_t i = 0; i < series.range.size(); ++i) {
    const double step = step_of(series, i);
    if (!(step > 0)) continue;
    // About half a step in each direction across the beam.
    const double angle = 0.5 * step / series.range[i];
    const double rounding = static_cast<double>(series.zenith_rounding_variance[i]);
    sum += 2.0 * angle * angle / (noise * noise + rounding);
  }
  return std::sqrt(sum);
}

}  // namespace risley::estimation
